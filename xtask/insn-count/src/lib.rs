//! A QEMU plugin that counts executed instructions exactly.
//!
//! `qemu-system-arm ... -plugin libinsn_count.so,out=FILE,begin=ADDR,begin_end=ADDR,end=ADDR`: counting starts when execution
//! leaves the function at `begin..begin_end`, stops when it enters the function at `end`, and each such region adds a line with
//! the number of instructions to FILE. The call of `end` itself is not counted. Addresses are hexadecimal.
//!
//! Only functions that every plugin API since QEMU 7.2 has in the same form are used; the API version that QEMU asks for is set
//! when the plugin is built (environment variable `ACTQ_QEMU_API`, default 1; 2 from QEMU 9.1 on).

use std::ffi::{CStr, c_char, c_int, c_uint, c_void};
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// The plugin API that this library was built for.
#[unsafe(no_mangle)]
pub static qemu_plugin_version: c_int = match option_env!("ACTQ_QEMU_API") {
    Some(text) => (text.as_bytes()[0] - b'0') as c_int,
    None => 1,
};

type Id = u64;
type TranslateCallback = unsafe extern "C" fn(Id, *mut c_void);
type ExecuteCallback = unsafe extern "C" fn(c_uint, *mut c_void);
type ExitCallback = unsafe extern "C" fn(Id, *mut c_void);

unsafe extern "C" {
    fn qemu_plugin_register_vcpu_tb_trans_cb(id: Id, callback: TranslateCallback);
    fn qemu_plugin_register_vcpu_insn_exec_cb(
        insn: *mut c_void,
        callback: ExecuteCallback,
        flags: c_int,
        data: *mut c_void,
    );
    fn qemu_plugin_register_atexit_cb(id: Id, callback: ExitCallback, data: *mut c_void);
    fn qemu_plugin_tb_n_insns(tb: *const c_void) -> usize;
    fn qemu_plugin_tb_get_insn(tb: *const c_void, index: usize) -> *mut c_void;
    fn qemu_plugin_insn_vaddr(insn: *const c_void) -> u64;
}

static BEGIN: AtomicU64 = AtomicU64::new(0);
static BEGIN_END: AtomicU64 = AtomicU64::new(0);
static END: AtomicU64 = AtomicU64::new(0);
static COUNTING: AtomicBool = AtomicBool::new(false);
static COUNT: AtomicU64 = AtomicU64::new(0);
static OUT: Mutex<Option<BufWriter<File>>> = Mutex::new(None);

unsafe extern "C" fn on_execute(_vcpu: c_uint, data: *mut c_void) {
    // The data is the instruction's address itself.
    let pc = data as u64;
    if (BEGIN.load(Relaxed)..BEGIN_END.load(Relaxed)).contains(&pc) {
        COUNTING.store(true, Relaxed);
        COUNT.store(0, Relaxed);
    } else if COUNTING.load(Relaxed) {
        if pc == END.load(Relaxed) {
            COUNTING.store(false, Relaxed);
            if let Ok(mut out) = OUT.lock()
                && let Some(out) = out.as_mut()
            {
                let _ = writeln!(out, "{}", COUNT.load(Relaxed).saturating_sub(1));
            }
        } else {
            COUNT.fetch_add(1, Relaxed);
        }
    }
}

unsafe extern "C" fn on_translate(_id: Id, tb: *mut c_void) {
    // SAFETY: QEMU hands over a translation block that is valid during this call; indexes stay below its length, and the
    // callback has the signature that QEMU expects. Flag 0: the callback reads no registers.
    unsafe {
        for i in 0..qemu_plugin_tb_n_insns(tb) {
            let insn = qemu_plugin_tb_get_insn(tb, i);
            let address = qemu_plugin_insn_vaddr(insn) as usize as *mut c_void;
            qemu_plugin_register_vcpu_insn_exec_cb(insn, on_execute, 0, address);
        }
    }
}

unsafe extern "C" fn on_exit(_id: Id, _data: *mut c_void) {
    if let Ok(mut out) = OUT.lock()
        && let Some(mut out) = out.take()
    {
        let _ = out.flush();
    }
}

/// QEMU's entry point; a return other than 0 refuses to load.
///
/// # Safety
///
/// Called by QEMU once, with `argc` strings that end with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn qemu_plugin_install(
    id: Id,
    _info: *const c_void,
    argc: c_int,
    argv: *const *const c_char,
) -> c_int {
    for i in 0..argc.max(0) as usize {
        // SAFETY: the caller's promise about argv.
        let argument = unsafe { CStr::from_ptr(*argv.add(i)) }.to_string_lossy().into_owned();
        let Some((key, value)) = argument.split_once('=') else { return 1 };
        let address = u64::from_str_radix(value, 16);
        match (key, address) {
            ("out", _) => match File::create(value) {
                Ok(file) => *OUT.lock().unwrap_or_else(|e| e.into_inner()) = Some(BufWriter::new(file)),
                Err(error) => {
                    eprintln!("insn-count: {value}: {error}");
                    return 1;
                }
            },
            ("begin", Ok(address)) => BEGIN.store(address, Relaxed),
            ("begin_end", Ok(address)) => BEGIN_END.store(address, Relaxed),
            ("end", Ok(address)) => END.store(address, Relaxed),
            _ => {
                eprintln!("insn-count: argument {argument:?} is not known");
                return 1;
            }
        }
    }
    // SAFETY: the callbacks have the signatures that QEMU expects and live as long as the library.
    unsafe {
        qemu_plugin_register_vcpu_tb_trans_cb(id, on_translate);
        qemu_plugin_register_atexit_cb(id, on_exit, std::ptr::null_mut());
    }
    0
}
