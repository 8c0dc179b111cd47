//! The files of a bundle.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use actq::data::arrays;
use actq::error::{Context as _, Result, bail, ensure};
use actq_onnx::{OnnxFile, Signature};

use crate::archive::Archive;
use crate::description::Network;
use crate::network::OnnxNetwork;
use crate::sources::{Array, Compute, Sources};

/// Ending of files that may be archives.
const ARCHIVE: &str = ".kinfer";
/// The most bytes of a text file.
const MAX_TEXT: u64 = 4 << 20;
/// The most files and folders of a bundle.
const MAX_FILES: usize = 10_000;

/// A folder with a policy's files, or one file.
#[derive(Clone, Debug)]
pub struct Bundle {
    root: PathBuf,
    /// Paths from the root, in alphabetical order.
    files: Vec<String>,
    /// Archives, whose files have their paths in front.
    archives: Rc<BTreeMap<String, Archive>>,
    /// Parsed ONNX files: several readers and each output of a network need the same one.
    parsed: RefCell<BTreeMap<String, Rc<OnnxFile>>>,
    /// Profile of the stack that it is of, if the user gives one.
    profile: Option<Rc<str>>,
    /// Networks by file and outputs, since reading one takes longer than running it.
    opened: RefCell<BTreeMap<(String, Vec<String>), OnnxNetwork>>,
}

impl Bundle {
    /// Lists a folder's files, without following links out of it; or takes one file.
    ///
    /// # Errors
    ///
    /// If it is missing, cannot be read, or has more than 10,000 entries.
    pub fn open(path: &Path) -> Result<Self> {
        let shown = || path.display().to_string();
        let is_file = fs::metadata(path).with_context(|| format!("{}: cannot read the bundle", shown()))?.is_file();
        if is_file {
            let name = path.file_name().and_then(|name| name.to_str());
            let name = name.with_context(|| format!("{}: the name is not UTF-8", shown()))?.to_owned();
            return Self::of(path.parent().unwrap_or(Path::new("")), vec![name]);
        }
        let mut files = Vec::new();
        let (mut open, mut seen) = (vec![String::new()], 0);
        while let Some(folder) = open.pop() {
            for entry in fs::read_dir(path.join(&folder)).with_context(shown)? {
                let entry = entry.with_context(shown)?;
                seen += 1;
                ensure!(seen <= MAX_FILES, "{}: it has more than {MAX_FILES} files; name the policy's folder", shown());
                let Some(name) = entry.file_name().to_str().map(str::to_owned) else { continue };
                let name = if folder.is_empty() { name } else { format!("{folder}/{name}") };
                let kind = entry.file_type().with_context(shown)?;
                if kind.is_dir() {
                    open.push(name);
                } else if kind.is_file() {
                    files.push(name);
                }
            }
        }
        Self::of(path, files)
    }

    /// Makes a bundle of files, and unpacks those of kinfer that are archives.
    fn of(root: &Path, mut files: Vec<String>) -> Result<Self> {
        let mut archives = BTreeMap::new();
        for file in files.clone().into_iter().filter(|file| file.ends_with(ARCHIVE)) {
            if let Some(archive) = Archive::open(&root.join(&file)).with_context(|| file.clone())? {
                files.extend(archive.names.iter().map(|name| format!("{file}/{name}")));
                archives.insert(file, archive);
            }
        }
        files.sort();
        Ok(Self {
            root: root.to_owned(),
            files,
            archives: Rc::new(archives),
            parsed: RefCell::default(),
            profile: None,
            opened: RefCell::default(),
        })
    }

    /// Reads it as one of the stack that a profile describes, whose rules hold; see `docs/families/README.md`.
    #[must_use]
    pub fn with_profile(mut self, text: &str) -> Self {
        self.profile = Some(text.into());
        self
    }

    /// Returns the profile that the user gives.
    pub(crate) fn profile(&self) -> Option<&str> {
        self.profile.as_deref()
    }

    /// Returns the folder that paths start at.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Returns the files, by their paths from the root, in alphabetical order.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        self.files.iter().map(String::as_str)
    }

    /// Returns `true` if the bundle has this file, by its path from the root.
    pub fn has(&self, file: &str) -> bool {
        self.files.iter().any(|own| own == file)
    }

    /// Returns the files with an extension.
    pub fn with_ending<'a>(&'a self, ending: &'a str) -> impl Iterator<Item = &'a str> + 'a {
        let ends = move |file: &&str| Path::new(file).extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
        self.files().filter(ends)
    }

    /// Returns what the nodes of the networks that were opened do with NaN and infinity, and the policy does not.
    pub fn guards(&self) -> BTreeSet<String> {
        let opened = self.opened.borrow();
        let of_file = |((file, _), network): (&(String, Vec<String>), &OnnxNetwork)| {
            network.guards.iter().map(|guard| format!("{file}: {guard}")).collect::<Vec<_>>()
        };
        opened.iter().flat_map(of_file).collect()
    }

    /// Returns the file whose path is, or ends in, `name`; `None` if there is none.
    ///
    /// # Errors
    ///
    /// If there are several.
    pub fn find(&self, name: &str) -> Result<Option<&str>> {
        let fits = |file: &&str| Path::new(file).ends_with(name);
        let found: Vec<&str> = self.files.iter().map(String::as_str).filter(fits).collect();
        match found[..] {
            [] => Ok(None),
            [one] => Ok(Some(one)),
            _ => bail!("several files are called {name:?}: {}; name the folder of one policy", found.join(", ")),
        }
    }

    /// Returns the path of a file that another one names.
    ///
    /// # Errors
    ///
    /// If it leaves the bundle.
    pub fn path(&self, file: &str) -> Result<PathBuf> {
        let inside = Path::new(file).components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        ensure!(
            inside && !file.is_empty(),
            "{file:?} is not a file of the bundle: give a path from its folder, without .."
        );
        let packed = file.rsplit_once('/').and_then(|(archive, name)| Some(self.archives.get(archive)?.path(name)));
        Ok(packed.unwrap_or_else(|| self.root.join(file)))
    }

    /// Returns an ONNX file, which is parsed once.
    ///
    /// # Errors
    ///
    /// If it is missing, or is not ONNX.
    pub fn onnx(&self, file: &str) -> Result<Rc<OnnxFile>> {
        let path = self.path(file)?;
        if let Some(parsed) = self.parsed.borrow().get(file) {
            return Ok(parsed.clone());
        }
        let parsed = Rc::new(OnnxFile::read(&path)?);
        self.parsed.borrow_mut().insert(file.to_owned(), parsed.clone());
        Ok(parsed)
    }

    /// Returns the inputs, outputs and metadata of an ONNX file.
    ///
    /// # Errors
    ///
    /// If it is missing, or is not ONNX.
    pub fn signature(&self, file: &str) -> Result<Signature> {
        Ok(self.onnx(file)?.signature())
    }

    /// Reads a text file.
    ///
    /// # Errors
    ///
    /// If it is missing, longer than 4 MiB, or not UTF-8.
    pub fn text(&self, file: &str) -> Result<String> {
        let path = self.path(file)?;
        let read = || -> Result<String> {
            let bytes = fs::metadata(&path)?.len();
            ensure!(bytes <= MAX_TEXT, "it has {bytes} bytes; at most {MAX_TEXT} are allowed");
            Ok(fs::read_to_string(&path)?)
        };
        read().with_context(|| file.to_owned())
    }
}

/// Returns the path of a file in the folder of another one.
pub(crate) fn beside(file: &str, name: &str) -> String {
    file.rsplit_once('/').map_or_else(|| name.to_owned(), |(folder, _)| format!("{folder}/{name}"))
}

impl Sources for Bundle {
    fn network(&self, network: &Network, outputs: &[String]) -> Result<Box<dyn Compute>> {
        let key = (network.file.clone(), outputs.to_vec());
        if let Some(opened) = self.opened.borrow().get(&key) {
            return Ok(Box::new(opened.clone()));
        }
        let file = self.onnx(&network.file)?;
        let opened = OnnxNetwork::open(&file, outputs)?;
        self.opened.borrow_mut().insert(key, opened.clone());
        Ok(Box::new(opened))
    }

    fn array(&self, file: &str, name: &str) -> Result<Array> {
        let mut all = arrays(&self.path(file)?)?;
        let names = all.keys().cloned().collect::<Vec<_>>().join(", ");
        let array = all.remove(name).with_context(|| format!("{file}: it has no array {name:?}; it has {names}"))?;
        Array::of(array).with_context(|| format!("{file}: array {name:?}"))
    }
}
