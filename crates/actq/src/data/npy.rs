//! Arrays in numpy's format .npy, versions 1 to 3 (numpy.lib.format): a header, which is the literal of a Python
//! dictionary, and the elements.

use std::io::{self, Read};

use ndarray::{ArrayD, IxDyn, ShapeBuilder as _};

use crate::error::{Context, Result, bail, ensure};
use crate::import::values::{Tensor, Values};

const MAGIC: &[u8] = b"\x93NUMPY";
/// Most bytes of a header's text; numpy writes about a hundred, and reads at most 10,000.
const MAX_HEADER: usize = 1 << 16;

/// Content of a header.
#[derive(Debug, PartialEq)]
struct Header {
    /// Type of the elements, for example `<f4`.
    descr: String,
    fortran_order: bool,
    shape: Vec<usize>,
}

/// Reads an array that takes `bytes` bytes of `source`. It allocates no more than the bytes that are present.
pub(super) fn read(source: &mut impl Read, bytes: u64) -> Result<Tensor> {
    let mut front = [0; 12];
    source.read_exact(&mut front[..8]).context("truncated in its header")?;
    ensure!(front.starts_with(MAGIC), "it does not begin with numpy's magic bytes");
    let length_bytes = match front[6..8] {
        [1, 0] => 2,
        [2 | 3, 0] => 4,
        [major, minor] => bail!("its format version is {major}.{minor}; use 1.0, 2.0 or 3.0"),
        _ => bail!("truncated in its header"),
    };
    source.read_exact(&mut front[8..8 + length_bytes]).context("truncated in its header")?;
    let header_len = u32::from_le_bytes([front[8], front[9], front[10], front[11]]) as usize;
    ensure!(header_len <= MAX_HEADER, "its header takes {header_len} bytes, but at most {MAX_HEADER} are allowed");
    let mut text = vec![0; header_len];
    source.read_exact(&mut text).context("truncated in its header")?;
    let text = String::from_utf8(text).context("its header is not UTF-8 text")?;
    let shown = || text.trim_end().chars().take(200).collect::<String>();
    let header =
        Header::parse(&text).with_context(|| format!("its header does not describe a plain array: {}", shown()))?;

    let there = bytes.saturating_sub((8 + length_bytes + header_len) as u64);
    let values = match header.descr.as_str() {
        "<f4" => Values::F32(header.elements(source, there, f32::from_le_bytes)?),
        ">f4" => Values::F32(header.elements(source, there, f32::from_be_bytes)?),
        "<f8" => Values::F64(header.elements(source, there, f64::from_le_bytes)?),
        ">f8" => Values::F64(header.elements(source, there, f64::from_be_bytes)?),
        "<i4" => Values::I32(header.elements(source, there, i32::from_le_bytes)?),
        ">i4" => Values::I32(header.elements(source, there, i32::from_be_bytes)?),
        "<i8" => Values::I64(header.elements(source, there, i64::from_le_bytes)?),
        ">i8" => Values::I64(header.elements(source, there, i64::from_be_bytes)?),
        other => {
            io::copy(&mut source.take(there), &mut io::sink())?;
            Values::Other(other.to_owned())
        }
    };
    Ok(Tensor { shape: header.shape, values })
}

/// Returns the header of an array in version 1.0, its last axis the fastest; `descr` is the element's
/// `numpy.dtype.str`.
pub fn npy_header(descr: &str, shape: &[usize]) -> Vec<u8> {
    let axes: String = shape.iter().map(|len| format!("{len}, ")).collect();
    let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({axes}), }}");
    // The elements begin at a multiple of 64 bytes, after a line feed.
    let length = (10 + text.len() + 1).next_multiple_of(64) - 10;
    let text = format!("{text:width$}\n", width = length - 1);
    [MAGIC, &[1, 0], &(length as u16).to_le_bytes(), text.as_bytes()].concat()
}

impl Header {
    /// Parses `{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }`, with the keys in any order, each once.
    fn parse(text: &str) -> Option<Self> {
        let mut rest = Literal(text);
        let (mut descr, mut fortran_order, mut shape) = (None, None, None);
        rest.token("{").then_some(())?;
        while !rest.token("}") {
            let key = rest.string()?;
            rest.token(":").then_some(())?;
            let known = match key {
                "descr" => descr.replace(rest.string()?.to_owned()).is_none(),
                "fortran_order" => fortran_order.replace(rest.boolean()?).is_none(),
                "shape" => shape.replace(rest.tuple()?).is_none(),
                _ => false,
            };
            known.then_some(())?;
            if !rest.token(",") {
                rest.token("}").then_some(())?;
                break;
            }
        }
        rest.0.trim().is_empty().then_some(Self { descr: descr?, fortran_order: fortran_order?, shape: shape? })
    }

    /// Reads the elements in row-major order from the `there` bytes that follow the header.
    fn elements<T: Copy, const N: usize>(
        &self,
        source: &mut impl Read,
        there: u64,
        element: fn([u8; N]) -> T,
    ) -> Result<Vec<T>> {
        let shape = &self.shape;
        let product = |dimensions: &[usize]| dimensions.iter().try_fold(N as u64, |n, &d| n.checked_mul(d as u64));
        let needed = if shape.contains(&0) { Some(0) } else { product(shape) };
        if needed != Some(there) {
            let needed = needed.map_or("more bytes than any file has".to_owned(), |n| format!("{n} bytes"));
            bail!(
                "truncated, or its header is wrong: {shape:?} of {N} bytes each need {needed}, but {there} are present"
            );
        }
        let mut bytes = Vec::new();
        source.take(there).read_to_end(&mut bytes)?;
        ensure!(bytes.len() as u64 == there, "truncated: {} of {there} bytes are present", bytes.len());
        let values: Vec<T> = bytes.as_chunks().0.iter().map(|b| element(*b)).collect();
        if values.is_empty() || !self.fortran_order {
            return Ok(values);
        }
        // The iterator is row-major whatever the order in memory.
        Ok(ArrayD::from_shape_vec(IxDyn(shape).f(), values)?.iter().copied().collect())
    }
}

/// The unparsed rest of a Python literal.
struct Literal<'a>(&'a str);

impl<'a> Literal<'a> {
    /// Takes `token` if it comes next.
    fn token(&mut self, token: &str) -> bool {
        let rest = self.0.trim_start().strip_prefix(token);
        self.0 = rest.unwrap_or(self.0);
        rest.is_some()
    }

    /// Takes a string without escapes.
    fn string(&mut self) -> Option<&'a str> {
        let quote = if self.token("'") { '\'' } else { self.token("\"").then_some('"')? };
        let (string, rest) = self.0.split_once(quote)?;
        self.0 = rest;
        (!string.contains('\\')).then_some(string)
    }

    fn boolean(&mut self) -> Option<bool> {
        if self.token("True") { Some(true) } else { self.token("False").then_some(false) }
    }

    /// Takes `()`, `(2,)`, `(2, 3)` or `(2, 3,)`.
    fn tuple(&mut self) -> Option<Vec<usize>> {
        self.token("(").then_some(())?;
        let mut numbers = Vec::new();
        while !self.token(")") {
            self.0 = self.0.trim_start();
            let (digits, rest) = self.0.split_at(self.0.find(|c: char| !c.is_ascii_digit())?);
            numbers.push(digits.parse().ok()?);
            self.0 = rest;
            if !self.token(",") {
                self.token(")").then_some(())?;
                // `(2)` is a number.
                return (numbers.len() > 1).then_some(numbers);
            }
        }
        Some(numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_header_is_read() {
        for shape in [&[3][..], &[2, 1], &[100_000, 1234, 567_890]] {
            let bytes = npy_header("<f4", shape);
            let text = std::str::from_utf8(&bytes[10..]).expect("text");
            assert!(bytes.len().is_multiple_of(64) && text.ends_with('\n'), "{text:?}");
            let expected = Header { descr: "<f4".to_owned(), fortran_order: false, shape: shape.to_vec() };
            assert_eq!(Header::parse(text.trim_end()), Some(expected));
        }
        let array = [npy_header("<f4", &[2]), 1f32.to_le_bytes().to_vec(), 2f32.to_le_bytes().to_vec()].concat();
        let read = read(&mut &array[..], array.len() as u64).expect("an array");
        assert!(matches!(read.values, Values::F32(values) if values == [1.0, 2.0]));
    }

    #[test]
    fn headers_are_parsed_strictly() {
        let header = |text: &str| Header::parse(text).map(|h| (h.descr, h.fortran_order, h.shape));
        let is = |fortran, shape: &[usize]| Some(("<f4".to_owned(), fortran, shape.to_vec()));
        let written = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }          \n";
        assert_eq!(header(written), is(false, &[2, 3]));
        assert_eq!(header("{\"shape\":(7,),\"fortran_order\":True,\"descr\":\"<f4\"}"), is(true, &[7]));
        assert_eq!(header("{'descr': '<f4', 'fortran_order': False, 'shape': ()}"), is(false, &[]));
        for (from, to) in [
            ("'<f4'", "[('x', '<f4')]"),
            ("'<f4'", "'\\x3cf4'"),
            ("'descr'", "'type'"),
            ("False", "0"),
            ("False", "False, 'fortran_order': True"),
            ("(2, 3)", "(2)"),
            ("(2, 3)", "(2, -3)"),
            ("(2, 3)", "(2, 3.0)"),
            ("(2, 3)", "(2,, 3)"),
            ("(2, 3)", "(2, 36893488147419103232)"),
            ("(2, 3)", "[2, 3]"),
            ("(2, 3)", "((2, 3))"),
            ("}", ""),
            ("}", "} 1"),
            ("{", ""),
        ] {
            assert_eq!(header(&written.replacen(from, to, 1)), None, "{to}");
        }
        for len in 0..written.trim_end().len() {
            assert_eq!(header(&written[..len]), None, "{len} characters");
        }
    }
}
