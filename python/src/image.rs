//! Images: their files, reports and sizes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use actq::emit::{Core, Trained, retrained};
use actq::measure::size::{bits_per_weight, hex};
use actq::measure::time::CLOCK;
use actq::runtime::ImageBuffer;
use actq_boards::Target;
use actq_cli::commands::{export_c, report};
use actq_cli::outputs::files::{refuse_foreign, write};
use actq_cli::report::{inspect, time};
use actq_kernels::PortKind;
use actq_onnx::export::{self, Attribute, Data, Grid, Tensor};
use anyhow::Context as _;
use numpy::{IntoPyArray as _, PyArrayMethods as _};
use pyo3::IntoPyObjectExt as _;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyDict, PyList, PyTuple};

use crate::error::{OrRaise as _, error, given};
use crate::policy::Policy;
use crate::work;

/// A port: kind, name, names of its values, and their number.
type Port = (&'static str, String, Vec<String>, usize);

/// An image: what a microcontroller runs.
///
/// `Image(bytes)` checks an image of `bytes`. `actq.quantize` makes one, `Image.load` reads a file.
#[pyclass(frozen, module = "actq")]
pub(crate) struct Image {
    buffer: ImageBuffer,
    name: PathBuf,
    /// Values that loops ask for: each [`Self::image`] checks all bytes.
    facts: Facts,
}

struct Facts {
    name: String,
    obs_len: usize,
    act_len: usize,
    rate_hz: f32,
    crc32: u32,
}

impl Image {
    /// Checks an image; errors call it `name`.
    pub(crate) fn of(buffer: ImageBuffer, name: &Path) -> PyResult<Self> {
        let image = buffer.image(name).or_raise()?;
        let facts = Facts {
            name: image.name().to_owned(),
            obs_len: image.obs_len(),
            act_len: image.act_len(),
            rate_hz: image.rate_hz(),
            crc32: image.crc(),
        };
        Ok(Self { buffer, name: name.to_owned(), facts })
    }

    pub(crate) fn image(&self) -> PyResult<actq_kernels::Image<'_>> {
        self.buffer.image(&self.name).or_raise()
    }

    pub(crate) fn buffer(&self) -> &ImageBuffer {
        &self.buffer
    }
}

#[pymethods]
impl Image {
    #[new]
    fn new(#[pyo3(from_py_with = given)] bytes: PyBackedBytes) -> PyResult<Self> {
        Self::of(ImageBuffer::new(&bytes), Path::new("image"))
    }

    /// Reads and checks the file of an image.
    #[staticmethod]
    fn load(#[pyo3(from_py_with = given)] path: PathBuf) -> PyResult<Self> {
        Self::of(ImageBuffer::read(&path).or_raise()?, &path)
    }

    /// Writes the file, whole or not at all. Replaces only an image, or an empty file.
    fn save(&self, py: Python<'_>, #[pyo3(from_py_with = given)] path: PathBuf) -> PyResult<()> {
        py.detach(|| refuse_foreign(&path).and_then(|()| write(&path, self.buffer.bytes()))).or_raise()
    }

    /// The bytes of the image's file.
    #[getter]
    fn bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.buffer.bytes())
    }

    /// Name of the policy.
    #[getter]
    fn name(&self) -> &str {
        &self.facts.name
    }

    /// Values of an observation.
    #[getter]
    pub(crate) const fn obs_len(&self) -> usize {
        self.facts.obs_len
    }

    /// Values of an action.
    #[getter]
    pub(crate) const fn act_len(&self) -> usize {
        self.facts.act_len
    }

    /// Control rate in Hz.
    #[getter]
    const fn rate_hz(&self) -> f32 {
        self.facts.rate_hz
    }

    /// CRC-32 of the image, as in its header.
    #[getter]
    const fn crc32(&self) -> u32 {
        self.facts.crc32
    }

    /// SHA-256 of the policy that the image was made from, as hexadecimal digits.
    #[getter]
    fn source(&self) -> PyResult<String> {
        Ok(hex(&self.image()?.digest()))
    }

    /// Bits per weight of the original network, with scales and padding; biases and header do not count.
    #[getter]
    fn bits_per_weight(&self) -> PyResult<f64> {
        Ok(bits_per_weight(&self.image()?))
    }

    /// Bytes of scratch memory that a head needs.
    #[getter]
    fn scratch_bytes(&self) -> PyResult<usize> {
        Ok(4 * self.image()?.scratch_words())
    }

    /// Raw inputs in the order of the observation, then targets in the order of the action, each as (kind, name, names
    /// of the values, their number). Empty without a description (docs/DEPLOY.md).
    #[getter]
    fn ports(&self) -> PyResult<Vec<Port>> {
        let port = |port: actq_kernels::Port<'_>| {
            let kind = match port.kind {
                PortKind::Input => "input",
                PortKind::Position => "position",
                PortKind::Velocity => "velocity",
                PortKind::Torque => "torque",
                _ => "output",
            };
            (kind, port.name.to_owned(), port.names.lines().map(str::to_owned).collect(), port.len)
        };
        Ok(self.image()?.ports().map(port).collect())
    }

    /// Returns the report of `actq inspect`.
    #[pyo3(signature = (*, clock = CLOCK, core = None))]
    fn inspect<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = given)] clock: f64,
        #[pyo3(from_py_with = given)] core: Option<String>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let image = self.image()?;
        let time = time::report(&image, core_of(core.as_deref())?, positive("clock", clock)?).or_raise()?;
        py.import("actq._report")?.getattr("Report")?.call1((format!("{}\n{time}", inspect::report(&image)),))
    }

    /// Makes the page of `actq report`. `policy` is the one that the image was made from; `recordings` are files.
    #[pyo3(signature = (policy = None, *, recordings = Vec::new()))]
    fn report<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = given)] policy: Option<PyRef<'_, Policy>>,
        #[pyo3(from_py_with = given)] recordings: Vec<PathBuf>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let policy = policy.map(|policy| policy.policy.clone());
        let (buffer, name) = (self.buffer.clone(), self.name.clone());
        let make = move |_: &_| report::of_image(&buffer, &name, policy.as_deref(), &recordings);
        let page = work::interruptible(py, None, make)?;
        py.import("actq._report")?.getattr("Page")?.call1((page,))
    }

    /// Predicts the cost of a step on a board or a core, as a dict.
    #[pyo3(signature = (board = None, *, clock = CLOCK, core = None))]
    fn cost<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = given)] board: Option<String>,
        #[pyo3(from_py_with = given)] clock: f64,
        #[pyo3(from_py_with = given)] core: Option<String>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let image = self.image()?;
        let core = core_of(core.as_deref())?;
        if let (Some(board), Some(_)) = (&board, core) {
            return Err(error!("both board {board:?} and core are given; pass one of them"));
        }
        let board = board.unwrap_or_else(|| "stm32f405".to_owned());
        let known = Target::ALL.into_iter().filter(|target| target.has_assembler() && *target != Target::M55);
        let target = known.clone().find(|target| target.board().name == board);
        if core.is_none() && target.is_none() {
            let mut names: Vec<&str> = known.map(|target| target.board().name).collect();
            names.dedup();
            return Err(error!("board {board:?} has no cost model; use one of {}, or core", names.join(", ")));
        }
        let step = time::of_image(&image, core, positive("clock", clock)?).or_raise()?;
        let cost = PyDict::new(py);
        cost.set_item("core", step.core.name())?;
        cost.set_item("board", core.is_none().then_some(board))?;
        cost.set_item("clock_hz", clock)?;
        cost.set_item("milliseconds", step.milliseconds)?;
        cost.set_item("cycles", step.cycles)?;
        cost.set_item("instructions", step.instructions)?;
        cost.set_item("macs", step.macs)?;
        cost.set_item("image_bytes", image.bytes())?;
        cost.set_item("scratch_bytes", 4 * image.scratch_words())?;
        let application = target.filter(|_| core.is_none()).and_then(|target| target.board().application);
        cost.set_item("scratch_limit", application.map(|application| 4 * application.scratch))?;
        Ok(cost)
    }

    /// Writes the image as source code of C into `folder`, as `actq export-c` does; returns the paths. Files that were
    /// not exported are replaced only with `force`.
    #[pyo3(signature = (folder, *, name = "policy".to_owned(), golden = None, steps = 100, force = false))]
    fn export_c(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = given)] folder: PathBuf,
        #[pyo3(from_py_with = given)] name: String,
        #[pyo3(from_py_with = given)] golden: Option<PathBuf>,
        #[pyo3(from_py_with = given)] steps: usize,
        #[pyo3(from_py_with = given)] force: bool,
    ) -> PyResult<Vec<PathBuf>> {
        if steps == 0 {
            return Err(error!("steps is 0; use a whole number from 1 on"));
        }
        let (buffer, own) = (self.buffer.clone(), self.name.clone());
        let (place, recording) = (folder.clone(), golden.clone());
        let files = work::interruptible(py, None, move |_| {
            let golden = recording.as_deref().map(|file| (file, steps));
            export_c::texts(buffer.image(&own)?, buffer.bytes(), &place, &name, golden)
        })?;
        let inputs: Vec<&Path> = golden.as_deref().into_iter().collect();
        py.detach(|| export_c::write(&files, &folder, &inputs, force)).or_raise()
    }

    /// Writes the image's network as an ONNX file in f32, whole or not at all. Replaces only a file whose name ends in
    /// .onnx.
    fn to_onnx(&self, py: Python<'_>, #[pyo3(from_py_with = given)] path: PathBuf) -> PyResult<()> {
        let image = self.image()?;
        if path.is_file() && path.extension().is_none_or(|ending| ending != "onnx") {
            return Err(error!("{}: exists and is no .onnx file; choose another name, or remove it", path.display()));
        }
        py.detach(|| {
            let network = export::network(&image).with_context(|| self.name.display().to_string())?;
            write(&path, &export::file(&network, image.name()))
        })
        .or_raise()
    }

    /// Returns the same network for `actq.FakeQuant`: inputs, outputs, constants, grids of weights as (steps [row,
    /// group], columns of a group, bits of each row), and nodes as (operator, inputs, output, attributes, magnitude to
    /// which the first input is rounded).
    fn network<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let network = export::network(&self.image()?).or_raise()?;
        let dict = PyDict::new(py);
        dict.set_item("inputs", network.inputs)?;
        dict.set_item("outputs", network.outputs)?;
        let tensors = PyDict::new(py);
        for Tensor { name, shape, data } in network.tensors {
            let array = match data {
                Data::Floats(values) => values.into_pyarray(py).reshape(shape)?.into_any(),
                Data::Integers(values) => values.into_pyarray(py).reshape(shape)?.into_any(),
            };
            tensors.set_item(name, array)?;
        }
        dict.set_item("tensors", tensors)?;
        let grids = PyDict::new(py);
        for Grid { weights, steps, group, bits } in network.grids {
            let shape = [bits.len(), steps.len() / bits.len()];
            grids.set_item(weights, (steps.into_pyarray(py).reshape(shape)?, group, bits.into_pyarray(py)))?;
        }
        dict.set_item("grids", grids)?;
        let nodes = PyList::empty(py);
        for node in network.nodes {
            let attributes = PyDict::new(py);
            for (name, value) in node.attributes {
                match value {
                    Attribute::Int(i) => attributes.set_item(name, i)?,
                    Attribute::Ints(ints) => attributes.set_item(name, ints)?,
                    Attribute::Float(f) => attributes.set_item(name, f)?,
                }
            }
            nodes.append((node.op, node.inputs, node.output, attributes, node.x_max))?;
        }
        dict.set_item("nodes", nodes)?;
        Ok(dict)
    }

    /// Returns the image with trained values for `actq.FakeQuant`: levels of weights, and other values, by the names that
    /// [`Self::network`] gives.
    fn retrained(
        &self,
        py: Python<'_>,
        levels: BTreeMap<String, Vec<i16>>,
        floats: BTreeMap<String, Vec<f32>>,
    ) -> PyResult<Self> {
        let trained = trained(levels, floats).ok_or_else(|| error!("a value is none of the image's"))?;
        let bytes = py.detach(|| retrained(self.buffer.bytes(), &trained)).or_raise()?;
        Self::of(ImageBuffer::new(&bytes), &self.name)
    }

    fn __len__(&self) -> usize {
        self.buffer.bytes().len()
    }

    fn __bytes__<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        self.bytes(py)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.buffer.bytes() == other.buffer.bytes()
    }

    fn __hash__(&self) -> u64 {
        self.facts.crc32.into()
    }

    fn __repr__(&self) -> PyResult<String> {
        let image = self.image()?;
        Ok(format!(
            "Image({:?}, {} observations -> {} actions, {:.3} bits per weight, {} bytes)",
            image.name(),
            image.obs_len(),
            image.act_len(),
            bits_per_weight(&image),
            image.bytes()
        ))
    }

    /// Makes images picklable.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let class = py.get_type::<Self>().into_bound_py_any(py)?;
        (class, (self.bytes(py),)).into_pyobject(py)
    }
}

/// Writes a file as [`Image::save`] does, whatever it replaces.
#[pyfunction]
#[pyo3(signature = (path, text))]
pub(crate) fn write_text(
    py: Python<'_>,
    #[pyo3(from_py_with = given)] path: PathBuf,
    #[pyo3(from_py_with = given)] text: String,
) -> PyResult<()> {
    py.detach(|| write(&path, text.as_bytes())).or_raise()
}

/// Sorts values by the names of [`export::network`], as "weight_3" and "table_5_0".
fn trained(levels: BTreeMap<String, Vec<i16>>, floats: BTreeMap<String, Vec<f32>>) -> Option<Trained> {
    let mut trained = Trained::default();
    for (name, values) in levels {
        trained.levels.insert(name.strip_prefix("weight_")?.parse().ok()?, values);
    }
    for (name, values) in floats {
        let (kind, number) = name.rsplit_once('_')?;
        let number = number.parse().ok()?;
        match kind {
            "bias" => drop(trained.biases.insert(number, values)),
            "norm_weight" => drop(trained.arrays.insert((number, 0), values)),
            "norm_bias" => drop(trained.arrays.insert((number, 1), values)),
            table => drop(trained.arrays.insert((table.strip_prefix("table_")?.parse().ok()?, number), values)),
        }
    }
    Some(trained)
}

/// Returns the core of this name, if one is given.
pub(crate) fn core_of(name: Option<&str>) -> PyResult<Option<Core>> {
    let known = |name: &str| {
        let names = Core::ALL.map(|(name, _)| format!("{name:?}")).join(", ");
        Core::of_name(name).ok_or_else(|| error!("core is {name:?}; use one of {names}"))
    };
    name.map(known).transpose()
}

/// Refuses a number that is not above 0.
pub(crate) fn positive(name: &str, value: f64) -> PyResult<f64> {
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err(error!("{name} is {value}; use a number above 0")) }
}
