//! A client of a motor controller.

use std::str::FromStr as _;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use actq_client::client::Client;
use actq_client::connection::Connection;
use actq_client::event::Event;
use actq_client::port::Address;
use actq_client::push::{Package, push};
use numpy::{AllowTypeChange, IntoPyArray as _, PyArray1, PyArrayLike1};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::error::{OrRaise as _, error, given};
use crate::image::{Image, positive};
use crate::work;

/// A connection to a motor controller.
#[pyclass(frozen, module = "actq")]
pub(crate) struct Link {
    port: String,
    /// `None` after `close`.
    client: Arc<Mutex<Option<Client>>>,
    timeout: Duration,
}

fn locked(client: &Mutex<Option<Client>>) -> MutexGuard<'_, Option<Client>> {
    client.lock().unwrap_or_else(PoisonError::into_inner)
}

fn closed() -> anyhow::Error {
    anyhow::anyhow!("the link is closed; open another")
}

impl Link {
    /// Makes a request that Ctrl-C may abandon.
    fn request<T: Send + 'static>(
        &self,
        py: Python<'_>,
        request: impl FnOnce(&mut Client) -> anyhow::Result<T> + Send + 'static,
    ) -> PyResult<T> {
        let client = self.client.clone();
        work::run(py, None, move |_| request(locked(&client).as_mut().ok_or_else(closed)?))
    }
}

#[pymethods]
impl Link {
    #[new]
    #[pyo3(signature = (port, *, timeout = 2.0))]
    fn new(
        py: Python<'_>,
        #[pyo3(from_py_with = given)] port: String,
        #[pyo3(from_py_with = given)] timeout: f64,
    ) -> PyResult<Self> {
        let address = Address::from_str(&port).map_err(|error| error.context(port.clone())).or_raise()?;
        let timeout = Duration::try_from_secs_f64(positive("timeout", timeout)?).or_raise()?;
        let client = work::run(py, None, move |_| {
            let name = address.to_string();
            let mut client = Client::new(Connection::open(address, timeout)?, timeout);
            client.status().map_err(|error| error.context(name))?;
            Ok(client)
        })?;
        Ok(Self { port, client: Arc::new(Mutex::new(Some(client))), timeout })
    }

    /// Returns the controller's status as a dict.
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let status = self.request(py, Client::status)?;
        let dict = PyDict::new(py);
        dict.set_item("state", status.state.to_string())?;
        dict.set_item("fault", status.fault.map(|fault| fault.to_string()))?;
        dict.set_item("refusal", status.refusal.map(|refusal| refusal.to_string()))?;
        dict.set_item("reset", status.reset.to_string())?;
        dict.set_item("ticks", status.ticks)?;
        dict.set_item("image", status.image)?;
        dict.set_item("slot", status.slot)?;
        dict.set_item("act_len", status.axes)?;
        dict.set_item("obs_len", status.observation)?;
        dict.set_item("refused", status.refused)?;
        Ok(dict)
    }

    /// Returns the measured times as a dict: ns, us for the head, bytes for the stack; 0 is not measured.
    fn timing<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let timing = self.request(py, Client::timing)?;
        let dict = PyDict::new(py);
        dict.set_item("period_ns", timing.period)?;
        dict.set_item("worst_tick_ns", timing.worst_tick)?;
        dict.set_item("worst_jitter_ns", timing.worst_jitter)?;
        dict.set_item("worst_head_us", timing.worst_head)?;
        dict.set_item("overruns", timing.overruns)?;
        dict.set_item("stack_bytes", timing.stack)?;
        Ok(dict)
    }

    /// Arms the controller: its outputs follow the head.
    fn arm(&self, py: Python<'_>) -> PyResult<()> {
        self.request(py, Client::arm)
    }

    /// Disarms the controller: its outputs coast.
    fn disarm(&self, py: Python<'_>) -> PyResult<()> {
        self.request(py, Client::disarm)
    }

    /// Sends an observation and returns the head's action for it.
    #[pyo3(signature = (observation, *, timeout = None))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = given)] observation: PyArrayLike1<'py, f32, AllowTypeChange>,
        #[pyo3(from_py_with = given)] timeout: Option<f64>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let observation = observation.as_array().to_vec();
        let timeout = match timeout {
            Some(seconds) => Duration::try_from_secs_f64(positive("timeout", seconds)?).or_raise()?,
            None => self.timeout,
        };
        let action = self.request(py, move |client| {
            let number = client.observe(&observation)?;
            let sent = Instant::now();
            while sent.elapsed() < timeout {
                for event in client.events()? {
                    if let Event::Action { of, values, .. } = event
                        && of == number
                    {
                        return Ok(values);
                    }
                }
            }
            anyhow::bail!(
                "no action for {timeout:.1?}; the controller needs an image, and observations of its length in their range"
            )
        })?;
        Ok(action.into_pyarray(py))
    }

    /// Sends an image to the slot that does not run; the controller checks it, tests it, and runs it.
    #[pyo3(signature = (image, *, version = 0, signature = None, progress = None))]
    fn push(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = given)] image: PyRef<'_, Image>,
        #[pyo3(from_py_with = given)] version: u32,
        #[pyo3(from_py_with = given)] signature: Option<[u8; 64]>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (bytes, client) = (image.buffer().bytes().to_vec(), self.client.clone());
        work::run(py, progress, move |worker| {
            let package = Package { image: &bytes, version, signature: signature.as_ref() };
            let sent = |taken: usize| worker.report("sending", taken as f64 / bytes.len() as f64);
            push(locked(&client).as_mut().ok_or_else(closed)?, &package, sent)
        })
    }

    /// Refuses copies: `copy` and `pickle` call it.
    fn __reduce__(&self) -> PyResult<()> {
        Err(error!("a link cannot be copied or pickled; open another by actq.Link(port)"))
    }

    /// Closes the port.
    fn close(&self, py: Python<'_>) {
        py.detach(|| drop(locked(&self.client).take()));
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, PyTuple>) {
        self.close(py);
    }

    fn __repr__(&self) -> String {
        format!("Link({:?})", self.port)
    }
}
