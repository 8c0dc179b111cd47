//! Malicious or damaged recordings: none may end the process, exhaust memory or be misread.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use flate2::Crc;
use flate2::write::DeflateEncoder;
use tempfile::TempDir;

use super::{Dataset, Sizes};

const SIZES: Sizes = Sizes { obs: 3, noise: 0, out: 2, state: 0 };

/// Returns an array's bytes: `header` in numpy's format of a major version, then the elements.
fn npy(version: u8, header: &str, elements: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY".to_vec();
    bytes.extend([version, 0]);
    let len = header.len() as u32;
    bytes.extend(&len.to_le_bytes()[..if version == 1 { 2 } else { 4 }]);
    [&bytes, header.as_bytes(), elements].concat()
}

fn header(descr: &str, fortran_order: bool, shape: &str) -> String {
    let fortran_order = if fortran_order { "True" } else { "False" };
    format!("{{'descr': '{descr}', 'fortran_order': {fortran_order}, 'shape': {shape}, }}\n")
}

fn floats(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}

/// Returns four frames of three zeros.
fn obs() -> Vec<u8> {
    npy(1, &header("<f4", false, "(4, 3)"), &[0; 48])
}

/// A member of an archive: its content, and its description in the directory.
struct Member {
    name: &'static str,
    packed: Vec<u8>,
    method: u16,
    flags: u16,
    crc: u32,
    size: u32,
}

impl Member {
    fn stored(name: &'static str, bytes: &[u8]) -> Self {
        let mut crc = Crc::new();
        crc.update(bytes);
        Self { name, packed: bytes.to_vec(), method: 0, flags: 0, crc: crc.sum(), size: bytes.len() as u32 }
    }

    fn deflated(name: &'static str, bytes: &[u8]) -> Self {
        let mut encoder = DeflateEncoder::new(Vec::new(), flate2::Compression::best());
        encoder.write_all(bytes).expect("memory");
        Self { packed: encoder.finish().expect("memory"), method: 8, ..Self::stored(name, bytes) }
    }
}

fn archive(members: &[Member]) -> Vec<u8> {
    let (mut bytes, mut directory) = (Vec::new(), Vec::new());
    for member in members {
        let at = bytes.len() as u32;
        let sizes = [member.crc, member.packed.len() as u32, member.size].map(u32::to_le_bytes).concat();
        let both =
            [&20u16.to_le_bytes()[..], &member.flags.to_le_bytes(), &member.method.to_le_bytes(), &[0; 4], &sizes];
        let both = [&both.concat()[..], &(member.name.len() as u16).to_le_bytes(), &[0; 2]].concat();
        bytes.extend([b"PK\x03\x04", &both[..], member.name.as_bytes(), &member.packed].concat());
        directory
            .extend([&b"PK\x01\x02\x14\0"[..], &both, &[0; 10], &at.to_le_bytes(), member.name.as_bytes()].concat());
    }
    let count = (members.len() as u16).to_le_bytes();
    let place = [directory.len() as u32, bytes.len() as u32].map(u32::to_le_bytes).concat();
    [&bytes, &directory, &b"PK\x05\x06\0\0\0\0"[..], &count, &count, &place, &[0; 2]].concat()
}

fn load(dir: &TempDir, name: &str, bytes: &[u8]) -> Result<Dataset, String> {
    let path = dir.path().join(name);
    fs::write(&path, bytes).expect("a file");
    Dataset::load(&path, SIZES).map_err(|error| without_path(&path, &format!("{error:#}")))
}

fn without_path(path: &Path, error: &str) -> String {
    error.strip_prefix(&format!("{}: ", path.display())).expect("the file's name").to_owned()
}

fn folder() -> TempDir {
    TempDir::new().expect("a folder")
}

#[test]
fn all_header_versions_orders_and_types_are_read() {
    let dir = folder();
    let rows: Vec<f32> = (0..12).map(|i| i as f32).collect();
    let columns = floats((0..12).map(|i| (i % 4 * 3 + i / 4) as f32));
    let swapped: Vec<u8> = rows.iter().flat_map(|v| v.to_be_bytes()).collect();
    let wide: Vec<u8> = rows.iter().flat_map(|v| f64::from(*v).to_be_bytes()).collect();
    for (version, descr, fortran_order, elements) in [
        (1, "<f4", false, floats(rows.clone())),
        (2, "<f4", false, floats(rows.clone())),
        (3, "<f4", true, columns),
        (1, ">f4", false, swapped),
        (1, ">f8", false, wide),
    ] {
        let array = npy(version, &header(descr, fortran_order, "(4, 3)"), &elements);
        for (name, bytes) in [
            ("a.npy", array.clone()),
            ("stored.npz", archive(&[Member::stored("obs.npy", &array)])),
            ("deflated.npz", archive(&[Member::stored("other", b"?"), Member::deflated("obs", &array)])),
        ] {
            let read = load(&dir, name, &bytes).expect(name);
            assert!(read.obs.iter().eq(&rows), "{name}, version {version}, {descr}: {:?}", read.obs);
        }
    }
}

#[test]
fn headers_that_contradict_the_file_are_named() {
    let dir = folder();
    let shaped = |shape: &str| npy(1, &header("<f4", false, shape), &[0; 48]);
    let vast = {
        let mut bytes = npy(2, &header("<f4", false, "(4, 3)"), &[0; 48]);
        bytes[8..12].copy_from_slice(&u32::MAX.to_le_bytes());
        bytes
    };
    let cases: [(Vec<u8>, &str); 14] = [
        (
            npy(1, &header("<f4", false, "(0, 18446744073709551615)"), &[]),
            "array \"obs\" is empty: [0, 18446744073709551615]",
        ),
        (npy(1, &header("<f4", true, "(0, 18446744073709551615, 3)"), &[]), "array \"obs\" is empty"),
        (shaped("(0, 5, 3)"), "[0, 5, 3] of 4 bytes each need 0 bytes, but 48 are present"),
        (
            shaped("(18446744073709551615, 3)"),
            "[18446744073709551615, 3] of 4 bytes each need more bytes than any file has",
        ),
        (shaped("(4611686018427387904, 3)"), "more bytes than any file has, but 48 are present"),
        (
            shaped("(1000000000000, 3)"),
            "[1000000000000, 3] of 4 bytes each need 12000000000000 bytes, but 48 are present",
        ),
        (shaped("(3, 3)"), "[3, 3] of 4 bytes each need 36 bytes, but 48 are present"),
        (shaped("(4, -3)"), "its header does not describe a plain array: {'descr': '<f4'"),
        (npy(1, &"(".repeat(60_000), &[]), "its header does not describe a plain array: (((("),
        (npy(1, &header("<f4", false, "(4, 3)").replace("'<f4'", "[('x', '<f4')]"), &[0; 48]), "a plain array"),
        (npy(4, &header("<f4", false, "(4, 3)"), &[0; 48]), "its format version is 4.0"),
        (npy(2, &" ".repeat(70_000), &[]), "its header takes 70000 bytes, but at most 65536 are allowed"),
        (vast, "its header takes 4294967295 bytes, but at most 65536 are allowed"),
        (npy(1, &header("<f2", false, "(4, 3)"), &[0; 24]), "array \"obs\" is of type <f2; use float32 or float64"),
    ];
    for (bytes, expected) in cases {
        for (name, bytes) in [
            ("a.npy", bytes.clone()),
            ("stored.npz", archive(&[Member::stored("obs.npy", &bytes)])),
            ("deflated.npz", archive(&[Member::deflated("obs.npy", &bytes)])),
        ] {
            let error = load(&dir, name, &bytes).expect_err(expected);
            assert!(error.contains(expected), "{name}: {error} instead of {expected}");
        }
    }
}

#[test]
fn oversized_archives_are_refused_before_inflation() {
    let dir = folder();
    let zeros = |frames: usize| npy(1, &header("<f4", false, &format!("({frames}, 3)")), &vec![0; 12 * frames]);
    let mebibytes = |n: usize| zeros((n << 20) / 12);
    // Constant data is accepted: it deflates to a thousandth of its size.
    let constant = archive(&[Member::deflated("obs.npy", &mebibytes(8))]);
    assert!(constant.len() < 8 << 12);
    assert_eq!(load(&dir, "constant.npz", &constant).expect("zeros").frames(), (8 << 20) / 12);
    // Unused arrays are not inflated.
    let other = archive(&[Member::deflated("other.npy", &mebibytes(65)), Member::stored("obs.npy", &obs())]);
    assert_eq!(load(&dir, "other.npz", &other).expect("another array").frames(), 4);

    let bomb = archive(&[Member::deflated("obs.npy", &mebibytes(65))]);
    let error = load(&dir, "bomb.npz", &bomb).expect_err("a bomb");
    let expected = format!(
        "an archive of {} bytes may hold 67108864 (64 times its size, at least 64 MiB); save it uncompressed, with numpy.savez",
        bomb.len()
    );
    assert!(error.starts_with("cannot read array \"obs\": it has 6815") && error.ends_with(&expected), "{error}");
    let both = [Member::deflated("obs.npy", &mebibytes(40)), Member::deflated("action.npy", &mebibytes(40))];
    let error = load(&dir, "two.npz", &archive(&both)).expect_err("two halves of a bomb");
    assert!(error.starts_with("cannot read array \"action\": it has 4194"), "{error}");
}

#[test]
fn false_claims_of_an_archive_are_refused() {
    let dir = folder();
    let frames = |n: usize, bytes: usize| npy(1, &header("<f4", false, &format!("({n}, 3)")), &vec![0; bytes]);
    let whole = frames(100_000, 1_200_000);
    let (deflated, size) = (|| Member::deflated("obs.npy", &whole), whole.len() as u32);
    let cases: [(Vec<Member>, &str); 11] = [
        (vec![Member { size: size - 1, ..deflated() }], "of 4 bytes each need 1200000 bytes, but 1199999 are present"),
        (vec![Member { size: size + 1, ..deflated() }], "of 4 bytes each need 1200000 bytes, but 1200001 are present"),
        // The array's header has the size that the archive declares.
        (
            vec![Member { size: obs().len() as u32, ..Member::deflated("obs.npy", &frames(4, 1_200_000)) }],
            "it has more than the 118 bytes that the archive declares",
        ),
        (
            vec![Member { size, ..Member::deflated("obs.npy", &frames(100_000, 9)) }],
            "truncated: 9 of 1200000 bytes are present",
        ),
        (vec![Member { crc: 7, ..deflated() }], "its checksum is wrong"),
        (vec![Member { method: 12, ..deflated() }], "it is compressed by method 12; save it with numpy.savez"),
        (vec![Member { flags: 1, ..deflated() }], "it is encrypted"),
        (vec![Member { method: 8, ..Member::stored("obs.npy", &obs()) }], "cannot read array \"obs\""),
        (vec![Member::stored("obs.npy", &obs()), Member::stored("obs.npy", &whole)], "array \"obs\" occurs twice"),
        (vec![Member::stored("obs", &obs()), deflated()], "array \"obs\" occurs twice"),
        (vec![], "array \"obs\" is missing; the file holds nothing"),
    ];
    for (members, expected) in cases {
        let error = load(&dir, "a.npz", &archive(&members)).expect_err(expected);
        assert!(error.contains(expected), "{error} instead of {expected}");
    }
}

#[test]
fn no_damage_to_a_file_ends_the_process() {
    let dir = folder();
    let members = [
        Member::deflated("obs.npy", &obs()),
        Member::stored("length.npy", &npy(1, &header("<i8", false, "(1,)"), &4i64.to_le_bytes())),
    ];
    for (name, whole) in [("a.npz", archive(&members)), ("a.npy", obs())] {
        assert!(load(&dir, name, &whole).is_ok());
        for len in 0..whole.len() {
            load(&dir, name, &whole[..len]).expect_err("truncated");
        }
        for at in 0..whole.len() {
            for value in [0, 0xff, whole[at] ^ 1, whole[at] ^ 0x80] {
                let mut bytes = whole.clone();
                bytes[at] = value;
                // Any result is fine, as long as the call returns.
                drop(load(&dir, name, &bytes));
            }
        }
    }
}

#[test]
fn duplicate_tensors_are_refused() {
    let dir = folder();
    // Two tensors over the same bytes, one of them transposed.
    let header = r#"{"obs":{"dtype":"F32","shape":[4,3],"data_offsets":[0,48]},"obs":{"dtype":"F32","shape":[1,4,3],"data_offsets":[0,48]}}"#;
    let bytes = [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), &[0; 48]].concat();
    let error = load(&dir, "a.safetensors", &bytes).expect_err("twice");
    assert!(error.contains("its header: the key \"obs\" occurs twice"), "{error}");
}
