use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use actq_testkit::{Dtype, Random, safetensors};
use ndarray::{Array1, Array2, Array3, ArrayD, IxDyn, ShapeBuilder as _, s};
use tempfile::TempDir;

use super::arrays::Arrays;
use super::*;
use crate::calibrate::moments;
use crate::calibrate::windows::Windows;
use crate::graph::Graph;
use crate::import::values::{Tensor, Values};
use crate::methods::{Method, PreparedMethod};
use crate::testing::{dataset, lstm, mlp};

const SIZES: Sizes = Sizes { obs: 3, noise: 0, out: 2, state: 0 };
const RECURRENT: Sizes = Sizes { obs: 3, noise: 0, out: 2, state: 4 };

/// An array of a file to be written: its type and shape, and its bytes in numpy's format and alone.
#[derive(Clone)]
struct Array {
    dtype: Dtype,
    shape: Vec<usize>,
    npy: Vec<u8>,
    bytes: Vec<u8>,
}

impl<T: Element> From<ArrayD<T>> for Array {
    fn from(array: ArrayD<T>) -> Self {
        let dtype = match T::DESCR {
            "<f4" => Dtype::F32,
            "<f8" => Dtype::F64,
            "<i4" => Dtype::I32,
            _ => Dtype::I64,
        };
        let (shape, mut npy) = (array.shape().to_vec(), Vec::new());
        write_npy(&mut npy, &shape, array.iter().copied()).expect("an array");
        let bytes = npy[npy_header(T::DESCR, &shape).len()..].to_vec();
        Self { dtype, shape, npy, bytes }
    }
}

/// Returns 0, 1, 2, ... in the given shape.
fn count(shape: &[usize]) -> ArrayD<f32> {
    let len = shape.iter().product::<usize>();
    ArrayD::from_shape_vec(IxDyn(shape), (0..len).map(|i| i as f32).collect()).expect("a shape")
}

fn ints(values: &[i64]) -> Array {
    Array::from(Array1::from(values.to_vec()).into_dyn())
}

fn obs() -> Array {
    Array::from(count(&[2, 5, 3]))
}

type Named = (&'static str, Array);

/// Writes a file in the format of its extension.
fn write(dir: &TempDir, name: &str, arrays: &[Named]) -> PathBuf {
    let path = dir.path().join(name);
    if name.ends_with(".npz") {
        let mut npz = NpzWriter::new(File::create(&path).expect("a file"));
        for (name, array) in arrays {
            npz.begin(name).expect("an array").write_all(&array.npy).expect("an array");
        }
        npz.finish().expect("an archive");
    } else if name.ends_with(".npy") {
        fs::write(&path, &arrays[0].1.npy).expect("a file");
    } else {
        let tensors = arrays.iter().map(|(name, array)| (name, array.dtype, &array.shape, array.bytes.clone()));
        fs::write(&path, safetensors(tensors)).expect("a file");
    }
    path
}

fn folder() -> TempDir {
    TempDir::new().expect("a folder")
}

#[test]
fn formats_and_types_give_equal_recordings() {
    let dir = folder();
    let wide = |a: ArrayD<f32>| Array::from(a.mapv(f64::from));
    let long = |values: &[i32]| Array::from(Array1::from(values.to_vec()).into_dyn());
    let narrow = || vec![("obs", obs()), ("action", Array::from(count(&[2, 5, 2]))), ("length", ints(&[5, 2]))];
    let doubles =
        || vec![("obs", wide(count(&[2, 5, 3]))), ("action", wide(count(&[2, 5, 2]))), ("length", long(&[5, 2]))];
    let mut fortran = ArrayD::zeros(IxDyn(&[2, 5, 3]).f());
    fortran.assign(&count(&[2, 5, 3]));
    let mut loaded = Vec::new();
    for (name, arrays) in [
        ("a.npz", narrow()),
        ("b.npz", doubles()),
        ("c.safetensors", narrow()),
        ("d.safetensors", doubles()),
        (
            "e.npz",
            vec![("obs", Array::from(fortran.clone())), ("action", wide(count(&[2, 5, 2]))), ("length", ints(&[5, 2]))],
        ),
    ] {
        // Unused arrays may have any name and type.
        let arrays: Vec<Named> = arrays.into_iter().chain([("seed", ints(&[1]))]).collect();
        let dataset = Dataset::load(&write(&dir, name, &arrays), SIZES).expect(name);
        assert_eq!(dataset.name(), name);
        loaded.push((dataset.obs, dataset.action, dataset.length, dataset.state));
    }
    assert!(loaded.iter().all(|one| *one == loaded[0]));
    let (obs_read, action, length, state) = &loaded[0];
    assert_eq!(obs_read.clone().into_dyn(), count(&[2, 5, 3]));
    assert_eq!(action.clone().map(|a| a.into_dyn()), Some(count(&[2, 5, 2])));
    assert_eq!((&length[..], state), (&[5, 2][..], &None));

    for array in [obs(), wide(count(&[2, 5, 3])), Array::from(fortran)] {
        let alone = Dataset::load(&write(&dir, "f.npy", &[("", array)]), SIZES).expect("npy");
        assert_eq!((&alone.obs, alone.action, &alone.length[..]), (obs_read, None, &[5, 5][..]));
    }
}

#[test]
fn two_axes_are_one_episode() {
    let dir = folder();
    for name in ["a.npy", "a.npz", "a.safetensors"] {
        let path = write(&dir, name, &[("obs", Array::from(count(&[7, 3])))]);
        let dataset = Dataset::load(&path, SIZES).expect(name);
        assert_eq!((dataset.obs.dim(), &dataset.length[..]), ((1, 7, 3), &[7][..]));
    }
    let arrays =
        [("obs", Array::from(count(&[7, 3]))), ("action", Array::from(count(&[7, 2]))), ("length", ints(&[4]))];
    let dataset = Dataset::load(&write(&dir, "b.npz", &arrays), SIZES).expect("actions with two axes");
    assert_eq!((dataset.frames(), dataset.action_at(0, 3)), (4, Some(vec![6.0, 7.0])));
}

fn with(place: [usize; 3], value: f64) -> Array {
    let mut array = count(&[2, 5, 3]).mapv(f64::from);
    array[&place[..]] = value;
    Array::from(array)
}

fn with_f32(place: [usize; 3], value: f32) -> Array {
    let mut array = count(&[2, 5, 3]);
    array[&place[..]] = value;
    Array::from(array)
}

/// Lists damaged arrays, and the whole message after the file's name.
fn spoilt() -> Vec<(Vec<Named>, &'static str)> {
    let floats = |shape: &[usize]| Array::from(count(shape));
    vec![
        (vec![("seed", ints(&[1])), ("act", obs())], "array \"obs\" is missing; the file holds act, seed"),
        (
            vec![("obs", obs()), ("terminated", ints(&[1]))],
            "array \"terminated\" says where episodes begin or end, and is not read: save \"obs\" as [episode, step, value], with \
             the steps of each episode as \"length\", or leave that array out if all steps are one episode",
        ),
        (
            vec![("obs", floats(&[5]))],
            "array \"obs\" has the shape [5]; use [episode, step, value], or [frame, value] for one episode",
        ),
        (
            vec![("obs", floats(&[1, 2, 5, 3]))],
            "array \"obs\" has the shape [1, 2, 5, 3]; use [episode, step, value], or [frame, value] for one episode",
        ),
        (vec![("obs", floats(&[0, 5, 3]))], "array \"obs\" is empty: [0, 5, 3]"),
        (vec![("obs", floats(&[2, 0, 3]))], "array \"obs\" is empty: [2, 0, 3]"),
        (vec![("obs", floats(&[2, 5, 4]))], "array \"obs\" has 4 values per step, and 3 are needed"),
        (
            vec![("obs", ints(&[1]))],
            "array \"obs\" has the shape [1]; use [episode, step, value], or [frame, value] for one episode",
        ),
        (
            vec![("obs", Array::from(count(&[2, 5, 3]).mapv(|v| v as i32)))],
            "array \"obs\" is of type int32; use float32 or float64",
        ),
        (vec![("obs", with_f32([1, 4, 2], f32::NAN))], "array \"obs\" holds NaN at episode 1, step 4, value 2"),
        (vec![("obs", with([0, 2, 1], f64::NEG_INFINITY))], "array \"obs\" holds -inf at episode 0, step 2, value 1"),
        (
            vec![("obs", with([0, 0, 0], -1e39))],
            "array \"obs\" holds -1e39, beyond float32's range, at episode 0, step 0, value 0",
        ),
        (
            vec![("obs", obs()), ("action", floats(&[2, 5, 3]))],
            "array \"action\" has the shape [2, 5, 3]; [2, 5, 2] is needed: the network's raw output at every observation",
        ),
        (
            vec![("obs", floats(&[5, 3])), ("action", floats(&[1, 5, 2]))],
            "array \"action\" has the shape [1, 5, 2]; [5, 2] is needed: the network's raw output at every observation",
        ),
        (
            vec![("obs", obs()), ("length", ints(&[5, 6]))],
            "episode 1 has length 6, but the array \"obs\" holds 5 steps",
        ),
        (vec![("obs", obs()), ("length", ints(&[-1, 5]))], "array \"length\" holds -1 for episode 0"),
        (
            vec![("obs", obs()), ("length", ints(&[5]))],
            "array \"length\" has the shape [1]; [2] is needed: the valid steps of each episode",
        ),
        (vec![("obs", obs()), ("length", floats(&[2]))], "array \"length\" is of type float32; use int32 or int64"),
        (vec![("obs", obs()), ("length", ints(&[0, 0]))], "the recording holds no frame: every episode has length 0"),
        (
            vec![("obs", obs()), ("state", floats(&[2, 4]))],
            "array \"state\" is present, but the policy has no recurrent state",
        ),
    ]
}

/// The same for the states of a recurrent policy.
fn spoilt_states() -> Vec<(Vec<Named>, &'static str)> {
    let mut infinite = count(&[2, 4]);
    infinite[[1, 2]] = f32::NEG_INFINITY;
    let state = |array| vec![("obs", obs()), ("state", Array::from(array))];
    vec![
        (
            state(count(&[2, 3])),
            "array \"state\" has the shape [2, 3]; [2, 4] is needed: the recurrent state before each episode's first step, hidden then cell state of each lstm, the state of each gru, in the order of the ops",
        ),
        (
            state(count(&[4])),
            "array \"state\" has the shape [4]; [2, 4] is needed: the recurrent state before each episode's first step, hidden then cell state of each lstm, the state of each gru, in the order of the ops",
        ),
        (state(infinite), "array \"state\" holds -inf at episode 1, value 2"),
    ]
}

#[test]
fn errors_name_the_array_and_its_fault() {
    let dir = folder();
    for (sizes, cases) in [(SIZES, spoilt()), (RECURRENT, spoilt_states())] {
        for (arrays, expected) in cases {
            for ending in ["npz", "safetensors"] {
                let path = write(&dir, &format!("r.{ending}"), &arrays);
                let error = format!("{:#}", Dataset::load(&path, sizes).expect_err(expected));
                assert_eq!(error, format!("{}: {expected}", path.display()));
            }
        }
    }
}

#[test]
fn steps_after_an_episodes_end_are_ignored() {
    let dir = folder();
    let arrays = [("obs", with([1, 4, 2], f64::NAN)), ("length", ints(&[5, 4]))];
    let dataset = Dataset::load(&write(&dir, "a.npz", &arrays), SIZES).expect("padding");
    assert_eq!((dataset.frames(), dataset.observations().count()), (9, 9));
    assert!(dataset.observations().flatten().all(|v| v.is_finite()));
}

#[test]
fn other_files_are_refused_by_name() {
    let dir = folder();
    let error = |path: &Path| {
        let error = format!("{:#}", Dataset::load(path, SIZES).expect_err("no recording"));
        error.strip_prefix(&format!("{}: ", path.display())).expect("the file's name").to_owned()
    };
    for (ending, is) in [("npz", "an .npz archive"), ("npy", "an .npy array"), ("safetensors", "a .safetensors file")] {
        let path = write(&dir, &format!("a.{ending}"), &[("obs", obs())]);
        let whole = fs::read(&path).expect("the file");
        for len in [1, 20, whole.len() / 2, whole.len() - 1] {
            fs::write(&path, &whole[..len]).expect("a file");
            let error = error(&path);
            assert!(error.starts_with(&format!("not {is}, or a truncated one")), "{len} bytes: {error}");
        }
        fs::write(&path, "observations: 1, 2, 3\n".repeat(20)).expect("a file");
        let text = error(&path);
        assert!(text.starts_with(&format!("not {is}, or a truncated one")), "{text}");
        fs::write(&path, "").expect("a file");
        assert_eq!(error(&path), "the file is empty");
        fs::remove_file(&path).expect("the file");
        assert!(error(&path).starts_with("cannot read the file"));
    }
    let half = write(&dir, "half.npz", &[("obs", obs())]);
    let other = dir.path().join("half.csv");
    fs::rename(half, &other).expect("a file");
    assert_eq!(error(&other), "unknown recording format; use .npz, .npy or .safetensors");
}

#[test]
fn two_recordings_in_a_folder_are_refused() {
    let dir = folder();
    let at = Some(dir.path());
    assert!(Recording::Calib.load(at, None, SIZES).expect("none").is_none());
    let missing = Recording::Heldout.require(at, None, SIZES, "this").expect_err("none").to_string();
    assert_eq!(
        missing,
        "this needs recorded observations: put heldout.npz, heldout.npy or heldout.safetensors beside policy.json, or name \
         a file with --heldout"
    );
    write(&dir, "heldout.npy", &[("", obs())]);
    for name in ["calib.npz", "calib.npy", "calib.safetensors"] {
        let path = write(&dir, name, &[("obs", obs())]);
        let found = Recording::Calib.load(at, None, SIZES).expect("one").expect("one");
        assert_eq!(found.path, path);
        fs::remove_file(path).expect("the file");
    }
    let (npy, _) = (write(&dir, "calib.npy", &[("", obs())]), write(&dir, "calib.npz", &[("obs", obs())]));
    let error = Recording::Calib.find(dir.path()).expect_err("two").to_string();
    assert_eq!(error, format!("{}: calib.npz and calib.npy are present; remove all but one", dir.path().display()));
    // A named file needs no search.
    let named = Recording::Calib.load(at, Some(&npy), SIZES).expect("named").expect("named");
    assert_eq!(named.path, npy);
}

#[test]
fn folders_expand_to_their_recordings() {
    let dir = folder();
    fs::create_dir(dir.path().join("drives")).expect("a folder");
    let drives = dir.path().join("drives");
    let error = files_of(std::slice::from_ref(&drives)).expect_err("none").to_string();
    let words = "the folder holds no recording (.npz, .npy or .safetensors)";
    assert_eq!(error, format!("{}: {words}", drives.display()));
    let other = write(&dir, "b.npz", &[("obs", obs())]);
    let expected: Vec<PathBuf> = ["drives/1.npy", "drives/2.npz", "drives/3.safetensors"]
        .map(|name| write(&dir, name, &[("obs", obs())]))
        .into();
    fs::write(drives.join("notes.txt"), "").expect("a file");
    fs::create_dir(drives.join("old.npz")).expect("a folder");
    let found = files_of(&[other.clone(), drives.clone()]).expect("four");
    assert_eq!(found, [vec![other], expected].concat());
    let twice = drives.join("../drives/2.npz");
    let error = files_of(&[drives, twice.clone()]).expect_err("one is named twice").to_string();
    assert_eq!(error, format!("{}: the recording is named twice and would count twice; name it once", twice.display()));
}

#[test]
fn too_few_frames_are_named() {
    let dir = folder();
    let dataset = Dataset::load(&write(&dir, "calib.npz", &[("obs", obs())]), SIZES).expect("ten frames");
    assert!(dataset.require_frames(10, "this").is_ok());
    let error = dataset.require_frames(11, "fewer repeat themselves").expect_err("ten").to_string();
    assert!(error.ends_with("calib.npz: it has 10 frames, but 11 are needed: fewer repeat themselves"), "{error}");
}

/// As `actq import --calib` does for a flow or diffusion policy.
#[test]
fn a_recording_with_noise_is_written_as_it_was_read() {
    let dir = TempDir::new().expect("a folder");
    let sizes = Sizes { noise: 4, ..SIZES };
    let stated = [("noise", Array::from(count(&[2, 5, 4]))), ("action", Array::from(count(&[2, 5, 2])))];
    for others in [&stated[..], &stated[..1], &[]] {
        let arrays: Vec<Named> = [("obs", obs())].into_iter().chain(others.iter().cloned()).collect();
        let read = Dataset::load(&write(&dir, "read.npz", &arrays), sizes).expect("a recording");
        let path = dir.path().join("written.npz");
        fs::write(&path, read.npz(sizes).expect("an archive")).expect("a file");
        assert_eq!(Arrays::read(&path).expect("arrays").has("noise"), !others.is_empty());
        let again = Dataset::load(&path, sizes).expect("a recording");
        assert_eq!((&again.obs, &again.action), (&read.obs, &read.action));
        // No array without values of another policy.
        let plain = Dataset { obs: read.obs.slice(s![.., .., ..3]).to_owned(), ..read };
        fs::write(&path, plain.npz(SIZES).expect("an archive")).expect("a file");
        assert!(!Arrays::read(&path).expect("arrays").has("noise"));
    }
}

/// Cuts the same steps into windows, with the state at the start of each.
fn cut(graph: &Graph, whole: &Dataset, window: usize) -> Dataset {
    let (_, steps, width) = whole.obs.dim();
    let windows = steps / window;
    let mut state = Vec::new();
    for w in 0..windows {
        // The state after all steps before the window.
        let mut states = crate::graph::zero_state(graph, 1);
        let network = crate::graph::Network::new(graph);
        for obs in whole.episode(0).take(w * window) {
            let obs = Array2::from_shape_vec((1, width), obs).expect("a row");
            network.forward(&crate::graph::Weights::of(graph), obs, &mut states);
        }
        state.extend(states.iter().flatten().flatten().copied());
    }
    let shaped = |array: &Array3<f32>| {
        let values = array.iter().copied().collect();
        Array3::from_shape_vec((windows, window, array.dim().2), values).expect("windows")
    };
    Dataset {
        path: "cut".into(),
        obs: shaped(&whole.obs),
        action: whole.action.as_ref().map(shaped),
        length: vec![window; windows],
        state: Some(Array2::from_shape_vec((windows, graph.state_len()), state).expect("states")),
    }
}

#[test]
fn windows_with_state_equal_whole_episodes() {
    let graph = lstm();
    assert_eq!(graph.state_len(), 6);
    let whole = dataset(&graph, 1, 20);
    let cut = cut(&graph, &whole, 5);
    let zero = Dataset { state: None, ..cut.clone() };

    // The f32 network's own actions, and all statistics of the methods.
    let actions = |dataset: &Dataset| {
        let mut dataset = Dataset { action: None, ..dataset.clone() };
        dataset.fill_actions(&graph);
        dataset.action.expect("actions").into_raw_vec_and_offset().0
    };
    let near = |a: &[f32], b: &[f32]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
    let recorded: Vec<f32> = whole.action.iter().flatten().copied().collect();
    assert!(near(&actions(&whole), &recorded) && near(&actions(&cut), &recorded));
    assert!(!near(&actions(&zero), &recorded));

    let moments = |dataset: &Dataset| {
        let all = moments::collect(&graph, dataset, &mut |_| {});
        all.iter().flat_map(|m| m.second.iter().map(|v| *v as f32).collect::<Vec<_>>()).collect::<Vec<f32>>()
    };
    assert!(near(&moments(&cut), &moments(&whole)) && !near(&moments(&zero), &moments(&whole)));

    let variance = |dataset: &Dataset| Windows::new(graph.clone(), dataset, 1).output_variance;
    assert!(near(&variance(&cut), &variance(&whole)) && !near(&variance(&zero), &variance(&whole)));
}

#[test]
fn the_network_fills_missing_actions() {
    let graph = mlp();
    let whole = dataset(&graph, 2, 6);
    let mut filled = Dataset { action: None, length: vec![6, 4], ..whole.clone() };
    filled.fill_actions(&graph);
    for (episode, step) in [(0, 0), (0, 5), (1, 3)] {
        assert_eq!(filled.action_at(episode, step), whole.action_at(episode, step));
    }
}

#[test]
fn a_long_recording_is_thinned() {
    let whole = dataset(&mlp(), 10, 200);
    assert_eq!(whole.thinned(2000, false).frames(), 2000);
    let thin = whole.thinned(100, false);
    assert_eq!((thin.frames(), thin.obs.dim().0), (100, 1));
    // The 35th of 100 evenly spaced frames of 2000 is the 700th: episode 3, step 100.
    assert_eq!(thin.obs.slice(s![0, 35, ..]), whole.obs.slice(s![3, 100, ..]));
    assert_eq!(thin.action_at(0, 35), whole.action_at(3, 100));

    let graph = lstm();
    let mut whole = dataset(&graph, 10, 200);
    whole.length[5] = 10;
    whole.state = Some(Array2::from_shape_fn((10, 6), |(e, _)| e as f32));
    let thin = whole.thinned(128, true);
    assert_eq!((&thin.length[..], thin.obs.dim()), (&[64, 10][..], (2, 64, 2)));
    assert_eq!(thin.obs.slice(s![0, 63, ..]), whole.obs.slice(s![0, 63, ..]));
    assert_eq!(thin.start(1), Some(vec![5.0; 6]));
    assert_eq!(whole.thinned(1000, true).length, [100, 100, 100, 100, 100, 10, 100, 100, 100, 100]);
}

fn recorded(name: &str, obs: Array3<f32>) -> Dataset {
    let length = vec![obs.dim().1; obs.dim().0];
    Dataset { path: format!("folder/{name}").into(), obs, action: None, length, state: None }
}

#[test]
fn dimensions_outside_the_range_are_named() {
    // Dimension v covers 0 to 9 v.
    let calib = recorded("calib.npz", Array3::from_shape_fn((2, 10, 4), |(_, s, v)| (s * v) as f32));
    let range = Range::of(&calib);
    let constant = range.constant_note().expect("dimension 0 is constant");
    assert_eq!(
        constant,
        "observation dimension 0 never changes in calib.npz, so the image's response when it moves is not calibrated; if \
         the robot can change it at run time, record episodes in which it does"
    );
    let same = range.outside(&calib);
    assert_eq!(same, Outside { frames: 20, outside: 0, dimensions: Vec::new() });

    let mut obs = calib.obs.clone();
    // Within a tenth of the range, and beyond it.
    (obs[[0, 0, 1]], obs[[0, 1, 1]]) = (9.89, -0.89);
    (obs[[0, 2, 2]], obs[[0, 2, 3]], obs[[0, 3, 3]]) = (-1.9, 30.0, 29.8);
    let heldout = recorded("heldout.npz", obs.clone());
    let outside = range.outside(&heldout);
    assert_eq!(outside, Outside { frames: 20, outside: 2, dimensions: vec![(3, 2), (2, 1)] });
    assert_eq!(
        range.warning(&heldout).expect("a tenth is outside"),
        "10.0% of the observations in heldout.npz leave the range of calib.npz by more than 10% of it, in dimensions 3 \
         (10.0%), 2 (5.0%): values there do not saturate, but the image was not fitted to them; record what the robot will observe"
    );
    // One in twenty gives no warning; a constant dimension has no margin.
    obs[[0, 2, 2]] = 0.0;
    obs[[0, 2, 3]] = 0.0;
    assert_eq!(range.warning(&recorded("heldout.npz", obs.clone())), None);
    obs[[0, 2, 0]] = 1e-6;
    assert!(range.warning(&recorded("heldout.npz", obs)).is_some_and(|text| text.contains("dimensions 0 (5.0%), 3")));

    let constant = recorded(
        "calib.npz",
        Array3::from_shape_fn((1, 9, 12), |(_, s, v)| if [3, 7, 8, 9].contains(&v) { 1.5 } else { s as f32 }),
    );
    let note = Range::of(&constant).constant_note().expect("constant dimensions");
    assert!(note.starts_with("observation dimensions 3, 7-9 never change in calib.npz, "), "{note}");
    let moving = recorded("calib.npz", Array3::from_shape_fn((1, 9, 2), |(_, s, _)| s as f32));
    assert_eq!(Range::of(&moving).constant_note(), None);
}

/// A recording of three values of different units, and a contact that is seldom other than 0.
fn ordinary(episodes: usize, steps: usize) -> Dataset {
    let obs = Array3::from_shape_fn((episodes, steps, 4), |(e, s, v)| {
        let wave = ((e * steps + s) as f32 * 0.37 + v as f32).sin();
        [wave, 0.01 * wave, 5.0 + 40.0 * wave, f32::from(u8::from(s == 3))][v]
    });
    recorded("calib.npz", obs)
}

#[test]
fn values_far_outside_all_others_are_named() {
    for (episodes, steps) in [(2, 10), (3, 700)] {
        assert_eq!(outside_note(&ordinary(episodes, steps)), None);
    }
    let note = |places: &[(usize, f32)]| {
        let mut dataset = ordinary(3, 700);
        places.iter().for_each(|(v, value)| dataset.obs[[1, 100 + 7 * v, *v]] = *value);
        outside_note(&dataset)
    };
    let one = note(&[(0, -1e4)]).expect("a note");
    assert!(
        one.starts_with("calib.npz: observation dimension 0 is -1.000e4 in episode 1, step 100, where all its "),
        "{one}"
    );
    let two = note(&[(0, 1e4), (1, 1e8), (3, 1e5)]).expect("a note");
    assert!(two.contains("dimension 1 is 1.000e8 in episode 1, step 107"), "{two}");
    assert!(two.contains(", and 2 values more are so far outside: "), "{two}");
    // Not above the ordinary values of dimension 2, and without a gap.
    assert_eq!(note(&[(0, 30.0), (1, 30.0)]), None);
    let mut heavy = ordinary(3, 700);
    (0..20).for_each(|i| heavy.obs[[0, 30 * i, 0]] = libm::powf(2.0, i as f32));
    assert_eq!(outside_note(&heavy), None);
    // A sensor that fails in many frames; padding.
    let mut often = ordinary(3, 700);
    (0..18).for_each(|i| often.obs[[2, 30 * i, 2]] = f32::MAX);
    assert!(outside_note(&often).is_some_and(|note| note.contains("17 values more")));
    often.length = vec![700, 700, 0];
    assert_eq!(outside_note(&often), None);
}

#[test]
fn a_frame_that_outweighs_all_others_is_named() {
    let mut dataset = ordinary(3, 700);
    dataset.action = Some(dataset.obs.clone());
    assert_eq!(heavy_note(&dataset, &dataset), None);
    for v in 0..3 {
        dataset.action.as_mut().expect("actions")[[2, 7, v]] = 1e4;
    }
    // The place is that in the whole recording.
    let thin = dataset.thinned(300, false);
    assert_eq!(thin.frames(), 300);
    let note = heavy_note(&thin, &dataset).expect("a note");
    assert!(note.contains("% of the actions' variance comes from episode 2, step 7, "), "{note}");
}

#[test]
fn steps_on_the_axis_of_episodes_are_noticed() {
    let mut random = Random::new(3);
    // Episodes of values that follow each other slowly.
    let mut walk = |episodes: usize, steps: usize| {
        let mut obs = Array3::zeros((episodes, steps, 3));
        for (e, v) in (0..episodes).flat_map(|e| (0..3).map(move |v| (e, v))) {
            let mut value = 0.0;
            for s in 0..steps {
                value = 0.95 * value + 0.3 * (random.unit() - 0.5);
                obs[[e, s, v]] = 10f32.powi(v as i32) * value;
            }
        }
        obs
    };
    let obs = walk(8, 300);
    assert_eq!(axes_note(&recorded("calib.npz", obs.clone())), None);
    let mut robots = recorded("calib.npz", obs.clone().permuted_axes([1, 0, 2]));
    let note = axes_note(&robots).expect("a note");
    assert!(note.starts_with("calib.npz looks like [step, robot, value]: ") && note.contains("swapaxes"), "{note}");
    // Lengths say what the axes are.
    robots.length[5] = 7;
    assert_eq!(axes_note(&robots), None);
    // Episodes that hardly differ, and frames that do not follow each other.
    let noise = walk(8, 300);
    let alike = Array3::from_shape_fn((8, 300, 3), |(e, s, v)| obs[[0, s, v]] + 0.03 * noise[[e, s, v]]);
    assert_eq!(axes_note(&recorded("calib.npz", alike)), None);
}

#[test]
fn values_that_no_sensor_measures_are_refused() {
    let graph = mlp();
    let mut dataset = dataset(&graph, 2, 200);
    let refused = |dataset: &Dataset, method| PreparedMethod::new(&graph, method, Some(dataset), |_| {}).map(drop);
    refused(&dataset, Method::Distill).expect("ordinary values");
    dataset.obs[[1, 7, 0]] = f32::MAX;
    for method in [Method::Gptq, Method::Distill] {
        let error = refused(&dataset, method).expect_err("a sentinel").to_string();
        assert!(
            error.contains("episode 1, step 7: ") && error.ends_with("leave out the step, or limit its values"),
            "{error}"
        );
    }
}

#[test]
fn arrays_in_memory_are_checked_like_files() {
    let tensor = |shape: &[usize], values| Tensor { shape: shape.to_vec(), values };
    let floats = |shape: &[usize]| tensor(shape, Values::F32(count(shape).into_iter().collect()));
    let named = |arrays: &[(&str, Tensor)]| arrays.iter().map(|(n, a)| ((*n).to_owned(), a.clone())).collect();
    let of = |arrays: &[(&str, Tensor)]| Dataset::of_arrays(Path::new("given"), named(arrays), SIZES);
    let dir = TempDir::new().expect("a folder");
    let read = Dataset::load(&write(&dir, "a.npz", &[("obs", obs())]), SIZES).expect("a recording");
    let given = of(&[("obs", floats(&[2, 5, 3])), ("other", floats(&[1]))]).expect("a recording");
    assert_eq!((&given.obs, &given.length, &*given.name()), (&read.obs, &read.length, "given"));
    for (arrays, expected) in [
        (vec![("observation", floats(&[5, 3]))], "given: array \"obs\" is missing; the file holds observation"),
        (vec![("obs", floats(&[5, 2]))], "given: array \"obs\" has 2 values per step, and 3 are needed"),
        (vec![("obs", tensor(&[5, 3], Values::Other("uint8".into())))], "given: array \"obs\" is of type uint8"),
    ] {
        let error = format!("{:#}", of(&arrays).expect_err(expected));
        assert!(error.starts_with(expected), "{error}");
    }
}

#[test]
fn actions_of_a_controller_are_ignored() {
    let array = |width: usize| Tensor { shape: vec![4, width], values: Values::F32(vec![0.5; 4 * width]) };
    let recording = [("obs", array(SIZES.obs)), ("action", array(SIZES.out))];
    let log = recording.iter().cloned().chain([("applied", array(1))]);
    let has_actions = |arrays: &[(&str, Tensor)]| {
        let named = arrays.iter().map(|(name, array)| ((*name).to_owned(), array.clone())).collect();
        Dataset::of_arrays(Path::new("given"), named, SIZES).expect("a recording").action.is_some()
    };
    assert!(has_actions(&recording));
    assert!(!has_actions(&log.collect::<Vec<_>>()));
}
