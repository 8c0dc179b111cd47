//! Recordings from Python: files, arrays, or arrays by the names that files give them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use actq::data::{Dataset, Sizes, files_of, joined};
use actq::import::values::{Tensor, Values};
use numpy::{PyArrayLike1, TypeMustMatch};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyMapping, PyString, PyTuple};

use crate::arrays::{array, tensor};
use crate::error::{OrRaise as _, error, given};

/// A recording that was passed, before its sizes are known.
#[derive(Clone, Debug)]
pub(crate) enum Passed {
    File(PathBuf),
    /// Its name for messages, and its arrays.
    Arrays(PathBuf, BTreeMap<String, Tensor>),
    /// Its name, and the observations of each episode.
    Episodes(PathBuf, Vec<Tensor>),
}

impl Passed {
    /// Reads a file, or checks arrays.
    pub(crate) fn load(self, sizes: Sizes) -> actq::error::Result<Dataset> {
        match self {
            Self::File(path) => Dataset::load(&path, sizes),
            Self::Arrays(name, arrays) => Dataset::of_arrays(&name, arrays, sizes),
            Self::Episodes(name, episodes) => {
                let one = |obs| Dataset::of_arrays(&name, BTreeMap::from([("obs".to_owned(), obs)]), sizes);
                let episodes = episodes.into_iter().map(one).collect::<actq::error::Result<Vec<_>>>()?;
                Ok(Dataset { path: name.clone(), ..joined(&episodes, sizes.state)? })
            }
        }
    }
}

/// Reads the argument `name`: `None`; a path; an array; a mapping of arrays; `(observations, starts)`; or a list of
/// these.
pub(crate) fn passed(object: Option<&Bound<'_, PyAny>>, name: &str) -> PyResult<Vec<Passed>> {
    let mut all = Vec::new();
    if let Some(object) = object {
        append(object, Path::new(name), &mut all)?;
    }
    Ok(all)
}

fn append(object: &Bound<'_, PyAny>, name: &Path, to: &mut Vec<Passed>) -> PyResult<()> {
    if object.is_instance_of::<PyString>() || object.hasattr("__fspath__")? {
        let files = files_of(&[object.extract::<PathBuf>()?]).or_raise()?;
        to.extend(files.into_iter().map(Passed::File));
    } else if object.hasattr("__array__")? {
        to.push(Passed::Arrays(name.to_owned(), BTreeMap::from([("obs".to_owned(), tensor(object)?)])));
    } else if let Ok(mapping) = object.cast::<PyMapping>() {
        let mut arrays = BTreeMap::new();
        for item in mapping.items()?.iter() {
            let (key, array): (String, Bound<'_, PyAny>) = given(&item)?;
            arrays.insert(key, tensor(&array)?);
        }
        to.push(Passed::Arrays(name.to_owned(), arrays));
    } else if let Ok(pair) = object.cast::<PyTuple>() {
        to.push(Passed::Episodes(name.to_owned(), episodes(pair, name)?));
    } else if let Ok(list) = object.cast::<PyList>() {
        if list.is_empty() {
            return Err(error!("{} is an empty list; pass a recording", name.display()));
        }
        for (i, item) in list.iter().enumerate() {
            append(&item, &PathBuf::from(format!("{}[{i}]", name.display())), to)?;
        }
    } else {
        return Err(error!(
            "{} is a {}; pass a path, an array, a mapping of arrays, (observations, starts), or a list of these",
            name.display(),
            object.get_type().name()?
        ));
    }
    Ok(())
}

/// Splits `(observations, starts)` into the observations of each episode. `starts[i]` is true if step i is the first of
/// an episode; so is step 0.
fn episodes(pair: &Bound<'_, PyTuple>, name: &Path) -> PyResult<Vec<Tensor>> {
    let shown = name.display();
    let wrong = || error!("{shown} is a tuple of {} items; pass (observations, starts)", pair.len());
    let (observations, starts): (Bound<'_, PyAny>, Bound<'_, PyAny>) = pair.extract().map_err(|_| wrong())?;
    let Tensor { shape, values } = tensor(&observations)?;
    let [frames, width] = shape[..] else {
        return Err(error!("{shown}[0] has the shape {shape:?}; with starts, pass [frame, value]"));
    };
    let starts: PyArrayLike1<'_, bool, TypeMustMatch> = array(&starts)?
        .extract()
        .map_err(|_| error!("{shown}[1] is no array of bool [frame]; pass one value for each frame"))?;
    let starts = starts.as_array();
    if starts.len() != frames {
        return Err(error!("{shown}[1] has {} values for {frames} frames; pass one for each frame", starts.len()));
    }
    let Some(values) = values.to_f32() else {
        return Err(error!("{shown}[0] is of type {}; use float32 or float64", values.type_name()));
    };
    let mut firsts: Vec<usize> = (0..frames).filter(|&i| i == 0 || starts[i]).collect();
    firsts.push(frames);
    let episode = |bounds: &[usize]| Tensor {
        shape: vec![bounds[1] - bounds[0], width],
        values: Values::F32(values[width * bounds[0]..width * bounds[1]].to_vec()),
    };
    Ok(firsts.windows(2).map(episode).collect())
}
