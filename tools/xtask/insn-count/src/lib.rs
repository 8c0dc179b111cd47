//! A QEMU plugin that counts executed instructions exactly, and the lines of flash that caches would have to fetch for
//! them.
//!
//! `qemu-system-arm ... -plugin libinsn_count.so,out=FILE,begin=ADDR,begin_end=ADDR,end=ADDR`: counting starts when
//! execution leaves the function at `begin..begin_end` and stops when it enters the function at `end`. The call of
//! `end` itself is not counted. Addresses are hexadecimal.
//!
//! Each such region adds lines to FILE: `region N DATA CODE NEXT1 .. NEXT8` with the number of instructions and of
//! lines fetched from flash: for data, for code after a jump, and for code after a line of which 1 to 8 instructions
//! were executed (meanwhile the next line can be prefetched). Then, for every executed instruction, `ADDR COUNT JUMPS`,
//! where JUMPS counts the executions that did not continue at the next instruction.
//!
//! Flash is the memory below 0x20000000, the code region of the Cortex-M's memory map. Fetched lines are those that the
//! caches of an STM32F4 would miss (reference manual RM0090, section 3.5.2): lines of 16 bytes, 64 for code and 8 for
//! data, the least recently used one replaced, both empty at the start of a region.
//!
//! The plugin uses only functions with the same form in every plugin API since QEMU 7.2. The build sets the API version
//! that QEMU requires (environment variable `ACTQ_QEMU_API`, default 1; 2 from QEMU 9.1 on).

use std::collections::BTreeMap;
use std::ffi::{CStr, c_char, c_int, c_uint, c_void};
use std::fs::File;
use std::io::{self, BufWriter, Write as _};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// The plugin API of this library's build.
#[unsafe(no_mangle)]
pub static qemu_plugin_version: c_int = match option_env!("ACTQ_QEMU_API") {
    Some(text) => (text.as_bytes()[0] - b'0') as c_int,
    None => 1,
};

type Id = u64;
type TranslateCallback = unsafe extern "C" fn(Id, *mut c_void);
type ExecuteCallback = unsafe extern "C" fn(c_uint, *mut c_void);
type MemoryCallback = unsafe extern "C" fn(c_uint, u32, u64, *mut c_void);
type ExitCallback = unsafe extern "C" fn(Id, *mut c_void);

unsafe extern "C" {
    fn qemu_plugin_register_vcpu_tb_trans_cb(id: Id, callback: TranslateCallback);
    fn qemu_plugin_register_vcpu_insn_exec_cb(
        insn: *mut c_void,
        callback: ExecuteCallback,
        flags: c_int,
        data: *mut c_void,
    );
    fn qemu_plugin_register_vcpu_mem_cb(
        insn: *mut c_void,
        callback: MemoryCallback,
        flags: c_int,
        accesses: c_int,
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
/// Next address if the last counted instruction does not jump; 0 at the start of a region.
static NEXT: AtomicU64 = AtomicU64::new(0);
/// The address of the last counted instruction.
static LAST: AtomicU64 = AtomicU64::new(0);
static OUT: Mutex<Option<BufWriter<File>>> = Mutex::new(None);
/// Every translated instruction by its address. They live as long as QEMU does.
static INSTRUCTIONS: Mutex<BTreeMap<u64, &'static Instruction>> = Mutex::new(BTreeMap::new());

const FLASH_END: u64 = 0x2000_0000;
/// Bytes of a line, as a power of two.
const LINE: u32 = 4;
/// `QEMU_PLUGIN_MEM_RW`: loads and stores. (QEMU 7.2 reports stores when only loads are requested; nothing stores to
/// flash.)
const ACCESSES: c_int = 3;
/// Instructions per line.
const LINE_INSTRUCTIONS: usize = 8;

static FLASH: Mutex<Flash> = Mutex::new(Flash::new());

/// The flash's caches, and their fetches in this region.
struct Flash {
    code: Cache,
    data: Cache,
    /// The line of the last counted instruction, and the instructions executed since execution reached it.
    line: Option<u64>,
    executed: usize,
    data_lines: u64,
    code_lines: u64,
    next_lines: [u64; LINE_INSTRUCTIONS],
}

impl Flash {
    const fn new() -> Self {
        Self {
            code: Cache { capacity: 64, lines: Vec::new() },
            data: Cache { capacity: 8, lines: Vec::new() },
            line: None,
            executed: 0,
            data_lines: 0,
            code_lines: 0,
            next_lines: [0; LINE_INSTRUCTIONS],
        }
    }

    /// Counts an executed instruction. One that straddles two lines counts for the first; the next instruction fetches
    /// the second.
    fn execute(&mut self, line: u64) {
        if self.line != Some(line) {
            if !self.code.access(line) {
                let next = self.line.is_some_and(|last| last + 1 == line);
                match self.next_lines.get_mut(self.executed.saturating_sub(1)) {
                    Some(count) if next => *count += 1,
                    // A loop within a line leaves all the time that the next line needs.
                    None if next => self.next_lines[LINE_INSTRUCTIONS - 1] += 1,
                    _ => self.code_lines += 1,
                }
            }
            (self.line, self.executed) = (Some(line), 0);
        }
        self.executed += 1;
    }

    fn load(&mut self, line: u64) {
        self.data_lines += u64::from(!self.data.access(line));
    }
}

/// A cache of lines, the least recently used one first.
struct Cache {
    capacity: usize,
    lines: Vec<u64>,
}

impl Cache {
    /// Returns `true` if the cache has the line; afterwards it has.
    fn access(&mut self, line: u64) -> bool {
        let found = self.lines.iter().rposition(|l| *l == line);
        match found {
            Some(at) => self.lines[at..].rotate_left(1),
            None => {
                if self.lines.len() == self.capacity {
                    self.lines.remove(0);
                }
                self.lines.push(line);
            }
        }
        found.is_some()
    }
}

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
            if address < FLASH_END
                && let Ok(mut flash) = FLASH.lock()
            {
                flash.execute(address >> LINE);
            }
            LAST.store(address, Relaxed);
            NEXT.store(address + instruction.size, Relaxed);
        }
    }
}

unsafe extern "C" fn on_access(_vcpu: c_uint, _info: u32, address: u64, _data: *mut c_void) {
    if address < FLASH_END
        && COUNTING.load(Relaxed)
        && let Ok(mut flash) = FLASH.lock()
    {
        flash.load(address >> LINE);
    }
}

fn count_jump(address: u64) {
    if let Some(instruction) = INSTRUCTIONS.lock().ok().and_then(|all| all.get(&address).copied()) {
        instruction.jumps.fetch_add(1, Relaxed);
    }
}

/// Writes the counts of the finished region, and resets them.
fn write_region() -> io::Result<()> {
    let (Ok(mut out), Ok(all)) = (OUT.lock(), INSTRUCTIONS.lock()) else { return Ok(()) };
    let Some(out) = out.as_mut() else { return Ok(()) };
    // The call of `end`.
    if let Some(call) = all.get(&LAST.load(Relaxed)) {
        call.count.fetch_sub(1, Relaxed);
    }
    let Ok(mut flash) = FLASH.lock() else { return Ok(()) };
    let Flash { data_lines, code_lines, next_lines, .. } = std::mem::replace(&mut *flash, Flash::new());
    let instructions = all.values().map(|i| i.count.load(Relaxed)).sum::<u64>();
    write!(out, "region {instructions} {data_lines} {code_lines}")?;
    next_lines.iter().try_for_each(|count| write!(out, " {count}"))?;
    writeln!(out)?;
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
    // SAFETY: QEMU hands over a translation block that is valid during this call; indexes stay below its length, and
    // the callbacks have the signatures that QEMU expects. Flag 0: they read no registers.
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
            qemu_plugin_register_vcpu_mem_cb(insn, on_access, 0, ACCESSES, std::ptr::null_mut());
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
                eprintln!("insn-count: unknown argument {argument:?}");
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
