//! A QEMU plugin that counts executed instructions exactly.
//!
//! `qemu-system-arm ... -plugin libinsn_count.so,out=FILE,begin=ADDR,begin_end=ADDR,end=ADDR`: counting starts when execution
//! leaves the function at `begin..begin_end` and stops when it enters the function at `end`. The call of `end` itself is not
//! counted. Addresses are hexadecimal.
//!
//! Each such region adds lines to FILE: `region N` with the number of instructions, then for every instruction that was
//! executed `ADDR COUNT JUMPS`, where JUMPS says how often execution did not go on at the next instruction.
//!
//! Only functions that every plugin API since QEMU 7.2 has in the same form are used; the API version that QEMU asks for is set
//! when the plugin is built (environment variable `ACTQ_QEMU_API`, default 1; 2 from QEMU 9.1 on).

use std::collections::BTreeMap;
use std::ffi::{CStr, c_char, c_int, c_uint, c_void};
use std::fs::File;
use std::io::{self, BufWriter, Write as _};
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
    fn qemu_plugin_insn_size(insn: *const c_void) -> usize;
}

static BEGIN: AtomicU64 = AtomicU64::new(0);
static BEGIN_END: AtomicU64 = AtomicU64::new(0);
static END: AtomicU64 = AtomicU64::new(0);
static COUNTING: AtomicBool = AtomicBool::new(false);
/// Where execution goes on if the last counted instruction does not jump; 0 at the start of a region.
static NEXT: AtomicU64 = AtomicU64::new(0);
/// The address of the last counted instruction.
static LAST: AtomicU64 = AtomicU64::new(0);
static OUT: Mutex<Option<BufWriter<File>>> = Mutex::new(None);
/// Every translated instruction by its address. They live as long as QEMU does.
static INSTRUCTIONS: Mutex<BTreeMap<u64, &'static Instruction>> = Mutex::new(BTreeMap::new());

/// An instruction of the guest. The guest has one CPU, so relaxed counters lose nothing.
struct Instruction {
    address: u64,
    size: u64,
    count: AtomicU64,
    jumps: AtomicU64,
}

unsafe extern "C" fn on_execute(_vcpu: c_uint, data: *mut c_void) {
    // SAFETY: `on_translate` hands over a reference that lives forever.
    let instruction = unsafe { &*data.cast_const().cast::<Instruction>() };
    let address = instruction.address;
    if (BEGIN.load(Relaxed)..BEGIN_END.load(Relaxed)).contains(&address) {
        COUNTING.store(true, Relaxed);
        NEXT.store(0, Relaxed);
    } else if COUNTING.load(Relaxed) {
        if address == END.load(Relaxed) {
            COUNTING.store(false, Relaxed);
            let _ = write_region();
        } else {
            let next = NEXT.load(Relaxed);
            if next != 0 && next != address {
                count_jump(LAST.load(Relaxed));
            }
            instruction.count.fetch_add(1, Relaxed);
            LAST.store(address, Relaxed);
            NEXT.store(address + instruction.size, Relaxed);
        }
    }
}

fn count_jump(address: u64) {
    if let Some(instruction) = INSTRUCTIONS.lock().ok().and_then(|all| all.get(&address).copied()) {
        instruction.jumps.fetch_add(1, Relaxed);
    }
}

/// Writes the counts of the region that has ended, and sets them back.
fn write_region() -> io::Result<()> {
    let (Ok(mut out), Ok(all)) = (OUT.lock(), INSTRUCTIONS.lock()) else { return Ok(()) };
    let Some(out) = out.as_mut() else { return Ok(()) };
    // The call of `end`.
    if let Some(call) = all.get(&LAST.load(Relaxed)) {
        call.count.fetch_sub(1, Relaxed);
    }
    writeln!(out, "region {}", all.values().map(|i| i.count.load(Relaxed)).sum::<u64>())?;
    for instruction in all.values() {
        let (count, jumps) = (instruction.count.swap(0, Relaxed), instruction.jumps.swap(0, Relaxed));
        if count > 0 {
            writeln!(out, "{:x} {count} {jumps}", instruction.address)?;
        }
    }
    Ok(())
}

unsafe extern "C" fn on_translate(_id: Id, tb: *mut c_void) {
    let Ok(mut all) = INSTRUCTIONS.lock() else { return };
    // SAFETY: QEMU hands over a translation block that is valid during this call; indexes stay below its length, and the
    // callback has the signature that QEMU expects. Flag 0: the callback reads no registers.
    unsafe {
        for i in 0..qemu_plugin_tb_n_insns(tb) {
            let insn = qemu_plugin_tb_get_insn(tb, i);
            let address = qemu_plugin_insn_vaddr(insn);
            let size = qemu_plugin_insn_size(insn) as u64;
            let new = || -> &'static Instruction {
                Box::leak(Box::new(Instruction { address, size, count: AtomicU64::new(0), jumps: AtomicU64::new(0) }))
            };
            let instruction: &'static Instruction = all.entry(address).or_insert_with(new);
            let data = std::ptr::from_ref(instruction).cast_mut().cast();
            qemu_plugin_register_vcpu_insn_exec_cb(insn, on_execute, 0, data);
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
