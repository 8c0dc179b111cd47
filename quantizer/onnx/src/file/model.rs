//! A parser of untrusted ONNX files: declared sizes are checked against the bytes of the file.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs::{self, File};
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::{Component, Path, PathBuf};

use actq::error::{Context as _, Error, Result, bail, ensure};
use actq::text::printable;
use half::{bf16, f16};
use prost::Message;
use prost::bytes::Bytes;

use crate::file::proto;
use crate::values::tensor::{Data, Tensor, count};

/// The most nodes, initializers, inputs or outputs of a graph, and attributes of a node.
const MOST_ENTRIES: usize = 1 << 16;
/// The most bytes of a file, which is protobuf's limit.
const MOST_BYTES: u64 = 1 << 31;

/// The most bytes of the file's metadata: names and gains take a few thousand.
const MOST_METADATA: usize = 1 << 20;

/// The first operator set whose arithmetic broadcasts as numpy does.
const LEAST_OPSET: i64 = 7;

/// A node.
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
    /// Texts that the exporter stored beside the graph, by key.
    pub(crate) metadata: BTreeMap<String, String>,
    /// Folder of external tensors.
    folder: PathBuf,
}

/// Reads the texts of a file; refuses keys that occur twice and texts of more than [`MOST_METADATA`] bytes.
fn metadata(entries: &[Bytes]) -> Result<BTreeMap<String, String>> {
    let mut texts = BTreeMap::new();
    let mut bytes = 0;
    for entry in all::<proto::Entry>(entries, "the metadata")? {
        let (key, value) = (entry.key.unwrap_or_default(), entry.value.unwrap_or_default());
        bytes += key.len() + value.len();
        ensure!(
            bytes <= MOST_METADATA,
            "the file has more than {MOST_METADATA} bytes of metadata; remove metadata_props"
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
    ensure!(list.len() <= MOST_ENTRIES, "{what} have {} entries; the limit is {MOST_ENTRIES}", list.len());
    list.iter().map(|bytes| decode(bytes, what)).collect()
}

impl Model {
    /// Reads a file.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let size = fs::metadata(path).context("cannot read the file")?.len();
        ensure!(size <= MOST_BYTES, "the file has {size} bytes; the limit for an ONNX file is {MOST_BYTES}");
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
            opset >= LEAST_OPSET,
            "the file uses opset {opset}, whose operators broadcast by other rules; export it with opset {LEAST_OPSET} or above"
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

    /// Returns the files in the model's folder that hold elements of its tensors, each one time.
    pub(crate) fn external_files(&self) -> Vec<PathBuf> {
        let constants = self.graph.nodes.iter().flat_map(|node| node.attributes.values()).filter_map(|a| a.t.as_ref());
        let mut files = BTreeSet::new();
        for bytes in self.graph.initializers.values().chain(constants) {
            let tensor: proto::Tensor = decode(bytes, "a tensor").unwrap_or_default();
            if tensor.data_location == Some(1)
                && let Ok(entries) = all::<proto::Entry>(&tensor.external_data, "the places of a tensor")
            {
                let location = entries.into_iter().find(|entry| entry.key.as_deref() == Some("location"));
                files.extend(location.and_then(|entry| entry.value).map(|location| self.folder.join(location)));
            }
        }
        files.into_iter().collect()
    }

    fn elements(&self, tensor: &proto::Tensor) -> Result<Tensor> {
        let axes = tensor.dims.iter().map(|&d| usize::try_from(d).ok()).collect::<Option<Vec<usize>>>();
        let shape = axes.with_context(|| format!("shape {:?} has a negative length", tensor.dims))?;
        let n = count(&shape)?;
        let kind = tensor.data_type.unwrap_or_default();
        let raw = match (tensor.data_location, &tensor.raw_data) {
            (Some(1), _) => Some(self.external(tensor, n)?),
            (_, raw) => raw.clone(),
        };
        let real = |v: &f32| f64::from(*v);
        let data = match (kind, &raw) {
            (1, Some(raw)) => Data::Real(cut(raw, |b| f64::from(f32::from_le_bytes(b)))?),
            (1, None) => Data::Real(tensor.float_data.iter().map(real).collect()),
            (11, Some(raw)) => Data::Real(cut(raw, f64::from_le_bytes)?),
            (11, None) => Data::Real(tensor.double_data.clone()),
            (10, Some(raw)) => Data::Real(cut(raw, |b| f16::from_le_bytes(b).to_f64())?),
            (10, None) => Data::Real(tensor.int32_data.iter().map(|&b| f16::from_bits(b as u16).to_f64()).collect()),
            (16, Some(raw)) => Data::Real(cut(raw, |b| bf16::from_le_bytes(b).to_f64())?),
            (16, None) => Data::Real(tensor.int32_data.iter().map(|&b| bf16::from_bits(b as u16).to_f64()).collect()),
            (7, Some(raw)) => Data::Int(cut(raw, i64::from_le_bytes)?),
            (7, None) => Data::Int(tensor.int64_data.clone()),
            (6, Some(raw)) => Data::Int(cut(raw, |b| i32::from_le_bytes(b).into())?),
            (4, Some(raw)) => Data::Int(cut(raw, |b| u16::from_le_bytes(b).into())?),
            (5, Some(raw)) => Data::Int(cut(raw, |b| i16::from_le_bytes(b).into())?),
            (12, Some(raw)) => Data::Int(cut(raw, |b| u32::from_le_bytes(b).into())?),
            (3, Some(raw)) => Data::Int(cut(raw, |b| i8::from_le_bytes(b).into())?),
            (2 | 9, Some(raw)) => Data::Int(cut(raw, |b| u8::from_le_bytes(b).into())?),
            (2..=6 | 9, None) => Data::Int(tensor.int32_data.iter().map(|&v| v.into()).collect()),
            (12, None) => Data::Int(tensor.uint64_data.iter().map(|&v| v as i64).collect()),
            _ => bail!("the type {} is not supported; export it as float32 or int64", kind_name(kind)),
        };
        let tensor = Tensor::new(shape, data);
        ensure!(tensor.len() == n, "shape {:?} needs {n} values, and {} are present", tensor.shape, tensor.len());
        Ok(tensor)
    }

    /// Reads the bytes of a tensor of `n` elements from a file in the model's folder.
    fn external(&self, tensor: &proto::Tensor, n: usize) -> Result<Bytes> {
        let entries: Vec<proto::Entry> = all(&tensor.external_data, "the places of a tensor")?;
        let entry = |key: &str| {
            let found = entries.iter().find(|entry| entry.key.as_deref() == Some(key));
            found.and_then(|entry| entry.value.as_deref())
        };
        let location =
            entry("location").context("the elements are in an external file without a name; export the file again")?;
        let shown = printable(location);
        let inside = Path::new(location).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        ensure!(
            inside && !location.is_empty(),
            "the elements are in {shown:?}, outside the model's folder; move that file beside the model"
        );
        let path = self.folder.join(location);
        let missing = || format!("cannot read {shown:?}, which holds the elements; put it beside the model");
        let (real, folder) = (fs::canonicalize(&path).with_context(missing)?, fs::canonicalize(&self.folder)?);
        ensure!(
            real.starts_with(folder),
            "the elements are in {shown:?}, a link that leaves the model's folder; copy the file instead"
        );
        ensure!(real.is_file(), "the elements are in {shown:?}, which is not a file");
        let mut file = File::open(real).with_context(missing)?;
        let there = file.metadata().with_context(missing)?.len();
        let number = |key: &str, default: u64| match entry(key) {
            None => Ok(default),
            Some(text) => text
                .parse()
                .map_err(Error::other)
                .with_context(|| format!("{key} {:?} is not a number", printable(text))),
        };
        let offset = number("offset", 0)?;
        let length = number("length", there.saturating_sub(offset))?;
        let end = offset.checked_add(length).filter(|end| *end <= there);
        ensure!(
            end.is_some(),
            "the elements are {length} bytes at offset {offset} of {shown:?}, which has {there} bytes"
        );
        ensure!(length <= 8 * n as u64, "the elements are {length} bytes of {shown:?}, too many for {n} values");
        let mut bytes = vec![0; usize::try_from(length)?];
        file.seek(SeekFrom::Start(offset)).and_then(|_| file.read_exact(&mut bytes)).with_context(missing)?;
        Ok(bytes.into())
    }
}

/// Returns ONNX's name of a type of elements.
pub(crate) fn kind_name(kind: i32) -> String {
    const NAMES: [&str; 17] = [
        "undefined",
        "float32",
        "uint8",
        "int8",
        "uint16",
        "int16",
        "int32",
        "int64",
        "string",
        "bool",
        "float16",
        "float64",
        "uint32",
        "uint64",
        "complex64",
        "complex128",
        "bfloat16",
    ];
    let name = usize::try_from(kind).ok().and_then(|kind| NAMES.get(kind));
    name.map_or_else(|| format!("ONNX's number {kind}"), |name| (*name).to_owned())
}

fn cut<const N: usize, T>(raw: &Bytes, one: impl Fn([u8; N]) -> T) -> Result<Vec<T>> {
    let (whole, rest) = raw.as_chunks::<N>();
    ensure!(rest.is_empty(), "{} bytes are not a whole number of elements of {N} bytes", raw.len());
    Ok(whole.iter().map(|bytes| one(*bytes)).collect())
}

impl Graph {
    /// Decodes the graph of a file or of an attribute.
    pub(crate) fn parse(bytes: &Bytes) -> Result<Self> {
        let graph: proto::Graph = decode(bytes, "the graph")?;
        let nodes = nodes(&graph.node)?;
        ensure!(
            graph.initializer.len() <= MOST_ENTRIES,
            "the graph has {} initializers; the limit is {MOST_ENTRIES}",
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

fn attributes(list: &[Bytes]) -> Result<HashMap<String, proto::Attribute>> {
    let attributes: Vec<proto::Attribute> = all(list, "the attributes")?;
    Ok(attributes.into_iter().map(|a| (a.name.clone().unwrap_or_default(), a)).collect())
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
