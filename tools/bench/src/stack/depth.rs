//! The deepest path of the call graph.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context as _, Result, bail, ensure};

use super::flow::{Callee, Frame, frame};
use super::program::Program;

/// Stack depth below the caller of a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Deepest {
    /// Bytes.
    bytes: u32,
    /// Its deepest callee, if any, with the bytes at the call and the kind of call.
    call: Option<(u32, u32, Callee)>,
}

/// A function on the deepest path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Call {
    /// Its name.
    pub function: String,
    /// Bytes of its frame at the call of the next function; the whole frame of the last one.
    pub frame: u32,
    /// `true` if it calls the next one by a pointer.
    pub by_pointer: bool,
}

/// The stack of all requested functions.
pub(super) struct Depths<'p> {
    program: &'p Program,
    /// Functions that a pointer may point to.
    taken: BTreeSet<u32>,
    frames: BTreeMap<u32, Frame>,
    /// `None` while the callees of a function are visited.
    deepest: BTreeMap<u32, Option<Deepest>>,
}

impl<'p> Depths<'p> {
    pub(super) fn new(program: &'p Program) -> Self {
        Self { program, taken: program.taken(), frames: BTreeMap::new(), deepest: BTreeMap::new() }
    }

    /// Computes the bytes of stack of a function with all its callees. An error names a recursive function, one that is
    /// not understood, or an address without a function.
    pub(super) fn of(&mut self, address: u32) -> Result<u32> {
        let name = self.name(address)?;
        match self.deepest.get(&address) {
            Some(Some(deepest)) => return Ok(deepest.bytes),
            Some(None) => bail!("{name} is recursive: its stack has no bound"),
            None => {}
        }
        let function = &self.program.functions[&address];
        let own = frame(self.program, function).with_context(|| format!("cannot compute the stack of {name}"))?;
        self.deepest.insert(address, None);
        let mut deepest = Deepest { bytes: own.bytes, call: None };
        for (callee, at) in &own.calls {
            let addresses = match callee {
                Callee::Function(address) => BTreeSet::from([*address]),
                Callee::Pointer => self.taken.clone(),
            };
            ensure!(!addresses.is_empty(), "{name} calls by a pointer, and no function's address is taken");
            for address in addresses {
                let below = self.of(address).with_context(|| format!("called by {name}"))?;
                if at + below > deepest.bytes {
                    deepest = Deepest { bytes: at + below, call: Some((address, *at, *callee)) };
                }
            }
        }
        self.frames.insert(address, own);
        self.deepest.insert(address, Some(deepest));
        Ok(deepest.bytes)
    }

    /// Returns the deepest path from a function down.
    pub(super) fn path(&mut self, address: u32) -> Result<Vec<Call>> {
        let (mut path, mut next) = (Vec::new(), Some(address));
        while let Some(address) = next {
            self.of(address)?;
            let call = self.deepest.get(&address).copied().flatten().and_then(|deepest| deepest.call);
            let frame = call.map_or_else(|| self.frames[&address].bytes, |(_, at, _)| at);
            let by_pointer = matches!(call, Some((_, _, Callee::Pointer)));
            path.push(Call { function: self.name(address)?, frame, by_pointer });
            next = call.map(|(callee, _, _)| callee);
        }
        Ok(path)
    }

    /// Returns the functions that call by pointers, and those that pointers may point to.
    pub(super) fn pointers(&self) -> Result<[Vec<String>; 2]> {
        let calling = self.frames.iter().filter(|(_, frame)| frame.calls.contains_key(&Callee::Pointer));
        let calling = calling.map(|(address, _)| self.name(*address)).collect::<Result<_>>()?;
        Ok([calling, self.taken.iter().map(|address| self.name(*address)).collect::<Result<_>>()?])
    }

    /// Returns the bytes of every function's own frame, by its address.
    pub(super) fn frames(&self) -> impl Iterator<Item = (u32, u32)> {
        self.frames.iter().map(|(address, frame)| (*address, frame.bytes))
    }

    pub(super) fn name(&self, address: u32) -> Result<String> {
        let function = self.program.functions.get(&address);
        Ok(function.with_context(|| format!("a call goes to {address:#x}, where no function begins"))?.name.clone())
    }
}
