//! Heads: the executor of the microcontroller, for one robot or thousands.

use std::sync::{Arc, Mutex, PoisonError};

use actq::runtime::prefix_bytes;
use actq_batch::Batch;
use actq_kernels::image::Cache;
use numpy::{AllowTypeChange, PyArrayDyn, PyArrayLikeDyn, PyArrayMethods as _};
use numpy::{IntoPyArray as _, PyUntypedArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{array, floats};
use crate::error::{error, given};
use crate::image::Image;
use crate::process::refuse_forked;
use crate::work;

/// The executor of an image, with n independent states.
#[pyclass(frozen, module = "actq")]
pub(crate) struct Head {
    image: Py<Image>,
    obs_len: usize,
    act_len: usize,
    seed: u32,
    /// `None` until the first observations decide how many states there are. An interrupted step still makes its step.
    batch: Arc<Mutex<Option<Batch>>>,
}

/// Makes this number of states in their beginning.
type States<'a> = &'a dyn Fn(usize) -> PyResult<Batch>;

/// Bytes of an image times heads from which work takes so long that Ctrl-C must end the wait for it: about 10 ms.
const LONG: usize = 1 << 26;

impl Head {
    /// Does `work` on the states, in a thread of its own if it is long. It takes what makes states in their beginning:
    /// state i has the seed of the head plus i.
    fn with<T: Send + 'static>(
        &self,
        py: Python<'_>,
        heads: usize,
        work: impl FnOnce(&mut Option<Batch>, States<'_>) -> PyResult<T> + Send + 'static,
    ) -> PyResult<T> {
        let (image, seed, batch) = (self.image.clone_ref(py), self.seed, Arc::clone(&self.batch));
        let is_long = heads.saturating_mul(image.get().buffer().bytes().len()) >= LONG;
        let run = move || {
            let states = |heads: usize| {
                let mut batch = Batch::new(image.get().buffer().bytes(), heads).map_err(raised)?;
                let seeds: Vec<u32> = (0..heads).map(|i| seed.wrapping_add(i as u32)).collect();
                batch.seed(&seeds).map_err(raised)?;
                Ok(batch)
            };
            work(&mut batch.lock().unwrap_or_else(PoisonError::into_inner), &states)
        };
        // The exception of failed work is its result.
        if is_long { work::interruptible(py, None, move |_| Ok(run()))? } else { py.detach(run) }
    }

    /// Returns the states u8 [n, bytes], if there are any.
    fn saved<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArrayDyn<u8>>>> {
        let saved = py.detach(|| {
            let kept = self.batch.lock().unwrap_or_else(PoisonError::into_inner);
            kept.as_ref().map(|batch| Ok((batch.heads(), batch.save()?))).transpose()
        });
        let Some((heads, bytes)) = saved.map_err(raised)? else { return Ok(None) };
        let len = bytes.len() / heads;
        Ok(Some(bytes.into_pyarray(py).reshape(vec![heads, len])?))
    }
}

/// Changes the states, or those of `heads` robots in their beginning if there are none yet: these are kept unless it fails.
fn change(
    kept: &mut Option<Batch>,
    states: States<'_>,
    heads: usize,
    work: impl FnOnce(&mut Batch) -> Result<(), actq_batch::Error>,
) -> PyResult<()> {
    if let Some(batch) = kept {
        return work(batch).map_err(raised);
    }
    let mut batch = states(heads)?;
    work(&mut batch).map_err(raised)?;
    *kept = Some(batch);
    Ok(())
}

/// Makes the head that was copied or pickled.
#[pyfunction]
pub(crate) fn head_of_states(
    py: Python<'_>,
    image: Py<Image>,
    seed: u32,
    states: Option<&Bound<'_, PyAny>>,
) -> PyResult<Head> {
    let head = Head::new(py, image, None, seed)?;
    states.map_or(Ok(()), |states| head.restore(py, states))?;
    Ok(head)
}

/// Reads a mask of the states to reset: bool [heads].
fn flags(mask: &Bound<'_, PyAny>, heads: usize) -> PyResult<Vec<bool>> {
    let array = array(mask)?;
    let Ok(array) = array.cast::<PyArrayDyn<bool>>() else {
        return Err(error!("reset is of type {}; pass bool [{heads}]", array.getattr("dtype")?));
    };
    if let [flags] = array.shape()
        && *flags != heads
    {
        return Err(error!("reset has {flags} values for {heads} observations; pass one for each"));
    }
    if array.shape().len() != 1 {
        return Err(error!("reset has the shape {:?} for {heads} observations; pass bool [{heads}]", array.shape()));
    }
    Ok(array.readonly().as_array().iter().copied().collect())
}

/// Returns the exception; the text of a head's error has that of its cause.
fn raised(error: actq_batch::Error) -> PyErr {
    error!("{error}")
}

/// Keys or values of a cache.
struct Part {
    /// `None` if they are those of all robots.
    robots: Option<usize>,
    values: Vec<f32>,
}

impl Part {
    /// Reads an array [tokens, heads, elements], or one such for each robot. Errors begin with `name`.
    fn of(name: &str, given: &Bound<'_, PyAny>, cache: Cache) -> PyResult<Self> {
        let (Cache { heads, dim, .. }, slots) = (cache, cache.prefix_slots());
        let array = floats(given)?;
        let robots = match *array.shape() {
            [_, h, d] if [h, d] == [heads, dim] => None,
            [n, _, h, d] if n > 0 && [h, d] == [heads, dim] => Some(n),
            _ => {
                return Err(error!(
                    "{name} have the shape {:?}; pass [tokens, {heads}, {dim}] for all robots, or [n, tokens, {heads}, \
                     {dim}], with at most {slots} tokens",
                    array.shape()
                ));
            }
        };
        Ok(Self { robots, values: array.as_array().iter().copied().collect() })
    }

    /// Returns the values of a robot.
    fn of_robot(&self, robot: usize) -> &[f32] {
        match self.robots {
            Some(n) => {
                let len = self.values.len() / n;
                &self.values[robot * len..][..len]
            }
            None => &self.values,
        }
    }
}

#[pymethods]
impl Head {
    #[new]
    #[pyo3(signature = (image, n = None, *, seed = 0))]
    fn new(
        py: Python<'_>,
        #[pyo3(from_py_with = given)] image: Py<Image>,
        #[pyo3(from_py_with = given)] n: Option<usize>,
        #[pyo3(from_py_with = given)] seed: u32,
    ) -> PyResult<Self> {
        let (obs_len, act_len) = (image.get().obs_len(), image.get().act_len());
        let head = Self { image, obs_len, act_len, seed, batch: Arc::default() };
        if let Some(n) = n {
            head.with(py, n, move |batch, states| {
                *batch = Some(states(n)?);
                Ok(())
            })?;
        }
        Ok(head)
    }

    /// Steps every state on its observation.
    #[pyo3(signature = (observations, reset = None))]
    fn __call__<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = floats)] observations: PyArrayLikeDyn<'py, f32, AllowTypeChange>,
        reset: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        refuse_forked()?;
        let given = observations.shape().to_vec();
        let (heads, shape) = match given[..] {
            [values] if values == self.obs_len => (1, vec![self.act_len]),
            [heads, values] if values == self.obs_len && heads > 0 => (heads, vec![heads, self.act_len]),
            _ => {
                return Err(error!(
                    "the observations have the shape {given:?}; use [{0}] for one, or [n, {0}] for a batch",
                    self.obs_len
                ));
            }
        };
        let reset: Option<Vec<bool>> = reset.map(|mask| flags(mask, heads)).transpose()?;
        // Copies: another thread may change numpy's memory.
        let observations: Vec<f32> = observations.as_array().iter().copied().collect();
        let act_len = self.act_len;
        let actions = self.with(py, heads, move |kept, states| {
            if let Some(batch) = kept
                && batch.heads() != heads
            {
                return Err(error!("{heads} observations for a head of {} states; make another head", batch.heads()));
            }
            let mut actions = vec![0.0; heads * act_len];
            // Observations that fail do not decide how many states there are.
            change(kept, states, heads, |batch| batch.step(&observations, reset.as_deref(), &mut actions))?;
            Ok(actions)
        })?;
        actions.into_pyarray(py).reshape(shape)
    }

    /// Resets every state: recurrent values, chunks, and the last action.
    fn reset(&self, py: Python<'_>) {
        py.detach(|| {
            if let Some(batch) = &mut *self.batch.lock().unwrap_or_else(PoisonError::into_inner) {
                batch.reset();
            }
        });
    }

    /// Returns the states of all robots: u8 [n, bytes]. A row has everything besides the image that the next actions of a
    /// robot depend on.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
        let Some(saved) = self.saved(py)? else {
            return Err(error!("the head has no states yet; step it, or make it by actq.Head(image, n)"));
        };
        Ok(saved)
    }

    /// Restores states that `state` returned: the robots go on with the same bits.
    fn restore(&self, py: Python<'_>, states: &Bound<'_, PyAny>) -> PyResult<()> {
        let array = array(states)?;
        let Ok(rows) = array.cast::<PyArrayDyn<u8>>() else {
            return Err(error!("the states are of type {}; pass the array of Head.state()", array.getattr("dtype")?));
        };
        let Some(heads) = Some(rows.shape()).filter(|shape| shape.len() == 2 && shape[0] > 0).map(|shape| shape[0])
        else {
            return Err(error!(
                "the states have the shape {:?}; pass the array [n, bytes] of Head.state()",
                rows.shape()
            ));
        };
        let needed = self.with(py, 1, |_, states| Ok(states(1)?.save().map_err(raised)?.len()))?;
        let given = rows.shape()[1];
        if given != needed {
            return Err(error!(
                "a state has {given} bytes, and one of this image {needed}; pass the array of Head.state() of a head of the same image"
            ));
        }
        let bytes: Vec<u8> = rows.readonly().as_array().iter().copied().collect();
        self.with(py, heads, move |kept, states| {
            if let Some(batch) = kept
                && batch.heads() != heads
            {
                return Err(error!("{heads} states for a head of {}; make another head", batch.heads()));
            }
            change(kept, states, heads, |batch| batch.restore(&bytes))
        })
    }

    /// Sets the prefix of all robots: keys and values of each cache, [tokens, heads, elements] of all or [n, ...] of each.
    fn set_prefix(&self, py: Python<'_>, caches: Vec<(Bound<'_, PyAny>, Bound<'_, PyAny>)>) -> PyResult<()> {
        let image = self.image.clone_ref(py);
        let needed: Vec<Cache> = image.get().image()?.prefix_caches().collect();
        if needed.is_empty() {
            return Err(error!("the image reads no prefix; step the head without one"));
        }
        if caches.len() != needed.len() {
            return Err(error!("{} caches of keys and values; the image's prefix has {}", caches.len(), needed.len()));
        }
        let parts = needed.into_iter().zip(&caches).enumerate().map(|(i, (cache, (keys, values)))| {
            let of = |name: &str, given| Part::of(&format!("the {name} of cache {i}"), given, cache);
            Ok([of("keys", keys)?, of("values", values)?])
        });
        let parts = parts.collect::<PyResult<Vec<_>>>()?;
        let robots = parts.iter().flatten().find_map(|part| part.robots);
        self.with(py, robots.unwrap_or(1), move |kept, states| {
            let heads = kept.as_ref().map(Batch::heads).or(robots).unwrap_or(1);
            if let Some(given) = parts.iter().flatten().filter_map(|part| part.robots).find(|given| *given != heads) {
                return Err(error!("keys or values of {given} robots for a head of {heads} states"));
            }
            let image = image.get().image()?;
            let row = |robot: usize| {
                let of_robot: Vec<_> =
                    parts.iter().map(|pair| pair.each_ref().map(|part| part.of_robot(robot))).collect();
                prefix_bytes(&image, &of_robot).map_err(|error| error!("{error:#}"))
            };
            let rows = match robots {
                Some(_) => (0..heads).map(row).collect::<PyResult<Vec<_>>>()?.concat(),
                None => row(0)?.repeat(heads),
            };
            change(kept, states, heads, |batch| batch.set_prefix(&rows))
        })
    }

    /// Clears the prefix of all robots: no step runs the network until the next one.
    fn clear_prefix(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, 0, |kept, _| {
            kept.iter_mut().for_each(Batch::clear_prefix);
            Ok(())
        })
    }

    /// Returns how `copy` and `pickle` make the head again: with its states.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let make = py.import("actq._actq")?.getattr("head_of_states")?;
        (make, (self.image.clone_ref(py), self.seed, self.saved(py)?)).into_pyobject(py)
    }

    /// The image.
    #[getter]
    fn image(&self, py: Python<'_>) -> Py<Image> {
        self.image.clone_ref(py)
    }

    /// Number of states; `None` before the first observations, unless n was given.
    #[getter]
    fn n(&self) -> Option<usize> {
        self.batch.lock().unwrap_or_else(PoisonError::into_inner).as_ref().map(Batch::heads)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let n = self.n().map_or("None".to_owned(), |n| n.to_string());
        Ok(format!("Head({}, n={n})", self.image.bind(py).repr()?))
    }
}
