//! A parser of untrusted ONNX files: declared sizes are checked against the bytes of the file.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs::{self, File};
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::{Component, Path, PathBuf};

use actq::error::{Context as _, Error, Result, ensure};
use actq::text::printable;
use prost::Message;
use prost::bytes::Bytes;

use crate::file::{kinds, proto};
use crate::values::tensor::{Tensor, count};

/// The most nodes, initializers, inputs or outputs of a graph, and attributes of a node.
const MAX_ENTRIES: usize = 1 << 16;
/// The most bytes of a file, which is protobuf's limit.
const MAX_BYTES: u64 = 1 << 31;

/// The most bytes of the file's metadata: names and gains take a few thousand.
const MAX_METADATA: usize = 1 << 20;

/// The most nested graphs and functions.
pub(crate) const MAX_DEPTH: usize = 16;

/// The first operator set whose arithmetic broadcasts as numpy does.
const MIN_OPSET: i64 = 7;

#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) name: String,
    pub(crate) op: String,
    pub(crate) domain: String,
    pub(crate) overload: String,
    pub(crate) inputs: Vec<String>,
    pub(crate) outputs: Vec<String>,
    pub(crate) attributes: HashMap<String, proto::Attribute>,
}

/// An input or output of the file's graph.
#[derive(Clone, Debug)]
pub(crate) struct Port {
    pub(crate) name: String,
    /// ONNX's type of the elements; 0 if not given.
    pub(crate) kind: i32,
    /// Length of each axis, `None` for a dynamic one; `None` as a whole without a shape.
    pub(crate) shape: Option<Vec<Option<usize>>>,
}

impl Port {
    /// Returns the number of values, with dynamic axes of length 1; `None` without a shape.
    pub(crate) fn len(&self) -> Option<usize> {
        self.shape.as_ref()?.iter().try_fold(1usize, |n, axis| n.checked_mul(axis.unwrap_or(1)))
    }
}

/// Nodes, with the initializers, inputs and outputs of their graph.
#[derive(Clone, Debug, Default)]
pub(crate) struct Graph {
    pub(crate) nodes: Vec<Node>,
    pub(crate) initializers: HashMap<String, Bytes>,
    pub(crate) inputs: Vec<Port>,
    pub(crate) outputs: Vec<Port>,
}

/// A function that the file defines.
#[derive(Debug)]
pub(crate) struct Function {
    pub(crate) inputs: Vec<String>,
    pub(crate) outputs: Vec<String>,
    pub(crate) defaults: HashMap<String, proto::Attribute>,
    pub(crate) graph: Graph,
}

/// A parsed file.
#[derive(Debug)]
pub(crate) struct Model {
    pub(crate) graph: Graph,
    /// Functions by domain, name and overload.
    pub(crate) functions: HashMap<[String; 3], Function>,
    /// Name and version of the exporter, and the opset, human-readable.
    pub(crate) producer: String,
    /// Version of ONNX's own operators that the file declares.
    pub(crate) opset: i64,
    /// Texts that the exporter stored beside the graph, by key.
    pub(crate) metadata: BTreeMap<String, String>,
    /// Folder of external tensors.
    folder: PathBuf,
}

/// Reads the texts of a file; refuses keys that occur twice and texts of more than [`MAX_METADATA`] bytes.
fn metadata(entries: &[Bytes]) -> Result<BTreeMap<String, String>> {
    let mut texts = BTreeMap::new();
    let mut bytes = 0;
    for entry in all::<proto::Entry>(entries, "the metadata")? {
        let (key, value) = (entry.key.unwrap_or_default(), entry.value.unwrap_or_default());
        bytes += key.len() + value.len();
        ensure!(
            bytes <= MAX_METADATA,
            "the file has more than {MAX_METADATA} bytes of metadata; remove metadata_props"
        );
        let before = texts.insert(key.clone(), value);
        ensure!(before.is_none(), "the metadata has the key {:?} twice; remove one", printable(&key));
    }
    Ok(texts)
}

fn decode<M: Message + Default>(bytes: &Bytes, what: &str) -> Result<M> {
    M::decode(bytes.clone())
        .map_err(Error::other)
        .with_context(|| format!("{what} cannot be decoded; the file is damaged or truncated"))
}

fn all<M: Message + Default>(list: &[Bytes], what: &str) -> Result<Vec<M>> {
    ensure!(list.len() <= MAX_ENTRIES, "{what} have {} entries; the limit is {MAX_ENTRIES}", list.len());
    list.iter().map(|bytes| decode(bytes, what)).collect()
}

impl Model {
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let size = fs::metadata(path).context("cannot read the file")?.len();
        ensure!(size <= MAX_BYTES, "the file has {size} bytes; the limit for an ONNX file is {MAX_BYTES}");
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Self::parse(fs::read(path).context("cannot read the file")?.into(), folder)
    }

    /// Parses a file whose tensors may be in other files of `folder`.
    pub(crate) fn parse(bytes: Bytes, folder: &Path) -> Result<Self> {
        ensure!(!bytes.is_empty(), "the file is empty");
        ensure!(
            !bytes.starts_with(b"version https://git-lfs"),
            "the file is not ONNX but a pointer of Git LFS; run git lfs pull in its repository"
        );
        ensure!(
            !bytes.starts_with(b"PK\x03\x04"),
            "the file is not ONNX but a zip archive, as PyTorch's checkpoints are; export the module to ONNX, or to a policy folder \
             (docs/IMPORT.md, PyTorch)"
        );
        let model: proto::Model = decode(&bytes, "the file is not ONNX: its protobuf")?;
        let graph = model.graph.as_ref().context("the file is not ONNX: it holds no graph")?;
        let opsets: Vec<proto::OperatorSet> = all(&model.opset_import, "the operator sets")?;
        let own = opsets.iter().find(|set| ["", "ai.onnx"].contains(&set.domain.as_deref().unwrap_or_default()));
        let opset = own
            .and_then(|set| set.version)
            .context("the file does not give the version of its ONNX operators (opset_import); export it again")?;
        ensure!(
            opset >= MIN_OPSET,
            "the file uses opset {opset}, whose operators broadcast by other rules; export it with opset {MIN_OPSET} or above"
        );
        let [name, version] = [&model.producer_name, &model.producer_version].map(|t| t.as_deref().unwrap_or_default());
        let producer = format!("{}, opset {opset}", printable(format!("{name} {version}").trim()));
        let functions: Vec<proto::Function> = all(&model.functions, "the functions")?;
        let functions = functions.into_iter().map(|function| {
            let key = [function.domain, function.name, function.overload].map(Option::unwrap_or_default);
            let graph = Graph { nodes: nodes(&function.node)?, ..Graph::default() };
            let defaults = attributes(&function.attribute_proto)?;
            Ok((key, Function { inputs: function.input, outputs: function.output, defaults, graph }))
        });
        Ok(Self {
            graph: Graph::parse(graph)?,
            functions: functions.collect::<Result<_>>()?,
            producer,
            opset,
            metadata: metadata(&model.metadata_props)?,
            folder: folder.to_owned(),
        })
    }

    /// Decodes a tensor of the file.
    pub(crate) fn tensor(&self, bytes: &Bytes) -> Result<Tensor> {
        let tensor: proto::Tensor = decode(bytes, "a tensor")?;
        let name = printable(tensor.name.as_deref().unwrap_or_default()).into_owned();
        let read = self.elements(&tensor).with_context(|| format!("tensor {name:?}"))?;
        Ok(Tensor { name: (!name.is_empty()).then_some(name), ..read })
    }

    /// Returns the files that hold elements of its tensors, by their paths from the model's folder.
    ///
    /// # Errors
    ///
    /// If a path leaves that folder.
    pub(crate) fn external_files(&self) -> Result<BTreeSet<PathBuf>> {
        let mut files = BTreeSet::new();
        let functions = self.functions.values().map(|function| &function.graph);
        for graph in [&self.graph].into_iter().chain(functions) {
            self.add_external_files(graph, &mut files, MAX_DEPTH)?;
        }
        Ok(files)
    }

    /// Adds the files of a graph's tensors, and of the graphs in its nodes.
    fn add_external_files(&self, graph: &Graph, files: &mut BTreeSet<PathBuf>, depth: usize) -> Result<()> {
        ensure!(depth > 0, "more than {MAX_DEPTH} graphs are nested");
        let attributes = || graph.nodes.iter().flat_map(|node| node.attributes.values());
        for bytes in graph.initializers.values().chain(attributes().filter_map(|attribute| attribute.t.as_ref())) {
            files.extend(self.external_file(bytes)?);
        }
        for bytes in attributes().filter_map(|attribute| attribute.g.as_ref()) {
            self.add_external_files(&Graph::parse(bytes)?, files, depth - 1)?;
        }
        Ok(())
    }

    /// Returns the file that holds a tensor's elements, if they are not in the model.
    fn external_file(&self, bytes: &Bytes) -> Result<Option<PathBuf>> {
        let tensor: proto::Tensor = decode(bytes, "a tensor")?;
        if tensor.data_location != Some(1) {
            return Ok(None);
        }
        let path = Places::of(&tensor).and_then(|places| places.path());
        let path = path.and_then(|path| self.inside(&path).map(|()| path));
        path.map(Some).with_context(|| format!("tensor {:?}", printable(tensor.name.as_deref().unwrap_or_default())))
    }

    /// Fails if a file of the model's folder is a link that leaves the folder.
    fn inside(&self, path: &Path) -> Result<()> {
        let Ok(real) = fs::canonicalize(self.folder.join(path)) else { return Ok(()) };
        ensure!(
            real.starts_with(fs::canonicalize(&self.folder)?),
            "the elements are in {:?}, a link that leaves the model's folder; copy the file instead",
            printable(&path.to_string_lossy())
        );
        Ok(())
    }

    fn elements(&self, tensor: &proto::Tensor) -> Result<Tensor> {
        let axes = tensor.dims.iter().map(|&d| usize::try_from(d).ok()).collect::<Option<Vec<usize>>>();
        let shape = axes.with_context(|| format!("shape {:?} has a negative length", tensor.dims))?;
        let n = count(&shape)?;
        let kind = tensor.data_type.unwrap_or_default();
        let bits = kinds::bits(kind).with_context(|| {
            format!("the type {} is not supported; export it as float32 or int64", kinds::name(kind))
        })?;
        let raw = match (tensor.data_location, &tensor.raw_data) {
            (Some(1), _) => Some(self.external(tensor, (n * bits).div_ceil(8))?),
            (_, raw) => raw.clone(),
        };
        let tensor = Tensor::new(shape, kinds::elements(tensor, kind, raw, n)?);
        ensure!(tensor.len() == n, "shape {:?} needs {n} values, and {} are present", tensor.shape, tensor.len());
        Ok(tensor)
    }

    /// Reads the `size` bytes of a tensor from a file in the model's folder.
    fn external(&self, tensor: &proto::Tensor, size: usize) -> Result<Bytes> {
        let places = Places::of(tensor)?;
        let path = places.path()?;
        let shown = printable(&path.to_string_lossy()).into_owned();
        let missing =
            || format!("cannot read {shown:?}, which holds the elements ({size} bytes); put it beside the model");
        self.inside(&path)?;
        let path = self.folder.join(path);
        let there = fs::metadata(&path).with_context(missing)?;
        ensure!(there.is_file(), "the elements are in {shown:?}, which is not a file");
        let there = there.len();
        let offset = places.number("offset", 0)?;
        let length = places.number("length", size as u64)?;
        let end = offset.checked_add(length).filter(|end| *end <= there);
        ensure!(
            end.is_some(),
            "the elements are {length} bytes at offset {offset} of {shown:?}, which has {there} bytes; copy the whole file"
        );
        ensure!(length == size as u64, "the elements are {length} bytes of {shown:?}, and the shape needs {size}");
        let mut bytes = vec![0; size];
        let mut file = File::open(path).with_context(missing)?;
        file.seek(SeekFrom::Start(offset)).and_then(|_| file.read_exact(&mut bytes)).with_context(missing)?;
        Ok(bytes.into())
    }
}

/// The place of a tensor's elements in another file.
struct Places(Vec<proto::Entry>);

impl Places {
    fn of(tensor: &proto::Tensor) -> Result<Self> {
        Ok(Self(all(&tensor.external_data, "the places of a tensor")?))
    }

    fn entry(&self, key: &str) -> Option<&str> {
        self.0.iter().find(|entry| entry.key.as_deref() == Some(key))?.value.as_deref()
    }

    /// Returns the file, by its path from the model's folder. Refuses a path that leaves it.
    fn path(&self) -> Result<PathBuf> {
        let location = self.entry("location");
        let location =
            location.context("the elements are in an external file without a name; export the file again")?;
        let mut path = PathBuf::new();
        for part in Path::new(location).components() {
            match part {
                Component::Normal(name) => path.push(name),
                Component::CurDir => {}
                _ => path.clear(),
            }
            ensure!(
                matches!(part, Component::Normal(_) | Component::CurDir),
                "the elements are in {:?}, outside the model's folder; move that file beside the model",
                printable(location)
            );
        }
        ensure!(
            path.file_name().is_some(),
            "the elements are in the file {:?}, which has no name",
            printable(location)
        );
        Ok(path)
    }

    fn number(&self, key: &str, default: u64) -> Result<u64> {
        self.entry(key).map_or(Ok(default), |text| {
            let number = text.parse().map_err(Error::other);
            number.with_context(|| format!("{key} {:?} is not a number", printable(text)))
        })
    }
}

impl Graph {
    /// Decodes the graph of a file or of an attribute.
    pub(crate) fn parse(bytes: &Bytes) -> Result<Self> {
        let graph: proto::Graph = decode(bytes, "the graph")?;
        let nodes = nodes(&graph.node)?;
        ensure!(
            graph.initializer.len() <= MAX_ENTRIES,
            "the graph has {} initializers; the limit is {MAX_ENTRIES}",
            graph.initializer.len()
        );
        let mut initializers = HashMap::new();
        for bytes in graph.initializer {
            let tensor: Name = decode(&bytes, "an initializer")?;
            let name = tensor.name.unwrap_or_default();
            let again = initializers.insert(name.clone(), bytes).is_some();
            ensure!(!again, "two initializers have the name {:?}", printable(&name));
        }
        Ok(Self { nodes, initializers, inputs: ports(&graph.input)?, outputs: ports(&graph.output)? })
    }
}

/// The name of a tensor, without its other fields.
#[derive(Clone, PartialEq, Message)]
struct Name {
    #[prost(string, optional, tag = "8")]
    name: Option<String>,
}

fn nodes(list: &[Bytes]) -> Result<Vec<Node>> {
    let one = |node: proto::Node| {
        Ok(Node {
            name: printable(&node.name.unwrap_or_default()).into_owned(),
            op: printable(&node.op_type.unwrap_or_default()).into_owned(),
            domain: node.domain.unwrap_or_default(),
            overload: node.overload.unwrap_or_default(),
            attributes: attributes(&node.attribute)?,
            inputs: node.input,
            outputs: node.output,
        })
    };
    all(list, "the nodes")?.into_iter().map(one).collect()
}

/// Sets a number that is 0, and an empty text: onnx.proto3's writers leave them out.
fn whole(mut attribute: proto::Attribute) -> proto::Attribute {
    match (attribute.r#type, &attribute.ref_attr_name) {
        (Some(1), None) => drop(attribute.f.get_or_insert_default()),
        (Some(2), None) => drop(attribute.i.get_or_insert_default()),
        (Some(3), None) => drop(attribute.s.get_or_insert_default()),
        _ => {}
    }
    attribute
}

fn attributes(list: &[Bytes]) -> Result<HashMap<String, proto::Attribute>> {
    let attributes: Vec<proto::Attribute> = all(list, "the attributes")?;
    Ok(attributes.into_iter().map(|a| (a.name.clone().unwrap_or_default(), whole(a))).collect())
}

fn ports(list: &[Bytes]) -> Result<Vec<Port>> {
    let ports: Vec<proto::ValueInfo> = all(list, "the inputs and outputs")?;
    let one = |port: proto::ValueInfo| {
        let tensor = port.r#type.and_then(|t| t.tensor_type).unwrap_or_default();
        let shape = tensor.shape.map(|shape| all::<proto::Dimension>(&shape.dim, "the axes")).transpose()?;
        let axis = |d: &proto::Dimension| d.dim_value.and_then(|n| usize::try_from(n).ok()).filter(|n| *n > 0);
        Ok(Port {
            name: port.name.unwrap_or_default(),
            kind: tensor.elem_type.unwrap_or_default(),
            shape: shape.map(|axes| axes.iter().map(axis).collect()),
        })
    };
    ports.into_iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_a_writer_left_out_is_0() {
        let of = |kind: Option<i32>, given: Option<&str>| {
            let attribute =
                proto::Attribute { r#type: kind, ref_attr_name: given.map(str::to_owned), ..Default::default() };
            let proto::Attribute { f, i, s, .. } = whole(attribute);
            (f, i, s.map(|text| text.len()))
        };
        assert_eq!(of(Some(1), None), (Some(0.0), None, None));
        assert_eq!(of(Some(2), None), (None, Some(0), None));
        assert_eq!(of(Some(3), None), (None, None, Some(0)));
        assert_eq!(of(Some(2), Some("axis")), (None, None, None), "the caller gives it");
        assert_eq!(of(None, None), (None, None, None));
    }
}
