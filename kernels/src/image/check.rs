//! The check of an image: everything in it, once. `docs/FORMAT.md` has the list.

#[cfg(feature = "attention")]
use super::attention::{MAX_DIM, MAX_SLOTS};
use super::contract::{ARRAY_BINARISE, CONTRACT_ARRAYS};
use super::front::Front;
use super::header::{self as h, Words};
use super::info::check_whole;
use super::matrix::{matrix, row_block};
use super::op::{Around, OpKind, Uses};
use super::ports::PortKind;
use super::proof::fits_i32;
use super::record::Op;
use super::region::Region;
use super::text::is_text;
use super::view::Image;
use super::words::{low, word};
use crate::activations::Plan;
use crate::error::ImageError;

/// The bits of infinity in bf16.
const BF16_INFINITY: u16 = (f32::INFINITY.to_bits() >> 16) as u16;

impl<'a> Image<'a> {
    /// Parses `bytes`, which must start at a multiple of 4 in memory and hold exactly the image.
    ///
    /// It checks the checksum, every section, every operation, all constants, and that no row can overflow its int32
    /// accumulator for any activations. Time is linear in the image's length.
    ///
    /// # Errors
    ///
    /// The first check that fails; `docs/FORMAT.md` lists all of them.
    #[inline(never)]
    pub fn new_checked(bytes: &'a [u8]) -> Result<Self, ImageError> {
        let image = Self::whole(bytes)?;
        image.check()?;
        Ok(image)
    }

    /// Parses `bytes` of an image that was checked elsewhere and cannot have changed since, as one that `actq export-c`
    /// wrote into the program: [`Self::new_checked`] without the check of the content, whose code takes 2.7 KB.
    ///
    /// It checks the header, the checksum, and that the build has what the image needs. The checksum finds damage, not
    /// intent: a head of an image that `new_checked` refuses is memory-safe and does not panic, but its steps end with
    /// meaningless actions or with [`StepError::Damaged`](crate::StepError::Damaged), and may take any time.
    ///
    /// # Errors
    ///
    /// The first of these checks that fails.
    #[inline(never)]
    pub fn new_checksummed(bytes: &'a [u8]) -> Result<Self, ImageError> {
        let image = Self::whole(bytes)?;
        image.check_built()?;
        for i in 0..image.op_count() {
            let op = &image.op(i);
            let op = op.as_ref().map_err(|e| *e)?;
            if op.is_linear() {
                let matrix = &op.linear_matrix();
                let matrix = matrix.as_ref().map_err(|e| *e)?;
                for record in matrix.records.as_chunks().0 {
                    row_block(matrix, record, 0).as_ref().map_err(|e| *e)?;
                }
            }
        }
        Ok(image)
    }

    /// Checks the bytes as a whole: alignment, header, checksum.
    #[inline(always)]
    pub(super) fn whole(bytes: &'a [u8]) -> Result<Self, ImageError> {
        if bytes.len() < h::WORDS * 4 {
            return Err(ImageError::TooShort);
        }
        if bytes.as_ptr().align_offset(4) != 0 {
            return Err(ImageError::Misaligned);
        }
        let words: &[u32] = bytemuck::try_cast_slice(bytes).map_err(|_| ImageError::Length)?;
        let image = Self { words, header: Words(words.first_chunk().ok_or(ImageError::TooShort)?) };
        check_whole(image.header, bytes)?;
        Ok(image)
    }

    /// Refuses an image that needs chunks or operations around a network, if the build has none. Operations, functions
    /// and widths that are missing are found where their records are read.
    fn check_built(&self) -> Result<(), ImageError> {
        let is_around = self.header.kind() >> 8 != 0;
        if !cfg!(feature = "around") && is_around || !cfg!(feature = "chunks") && self.needs_chunks() {
            return Err(ImageError::LeftOut);
        }
        Ok(())
    }

    fn check(&self) -> Result<(), ImageError> {
        let (kind, flags) = (self.header.kind() & 0xff, self.header.kind() >> 8);
        if flags > 1 || self.header.contract_flags() >> CONTRACT_ARRAYS != 0 {
            return Err(ImageError::Reserved);
        }
        self.check_built()?;
        match (kind, self.header.chunk(), self.header.execute()) {
            (0, 1, 1) => {}
            (1..=3, chunk, execute) if (1..=chunk).contains(&execute) => {}
            (0..=3, ..) => return Err(ImageError::Chunk),
            _ => return Err(ImageError::Kind),
        }
        let (horizon, overlap) = (self.header.horizon(), self.header.overlap());
        let averaged = horizon == 0 || horizon <= self.chunk() && self.execute() == 1 && overlap == 0;
        let in_time = self.deadline().is_none_or(|age| age >= self.execute().max(horizon));
        if !averaged || !in_time || overlap > self.chunk() - self.execute() {
            return Err(ImageError::Playback);
        }
        // Denoising steps have operations, and only a flow or diffusion policy has them.
        let (first, steps) = (self.first_denoising_op(), self.header.denoising_steps());
        let denoising =
            if self.kind().is_iterative() { steps > 0 && first < self.op_count() } else { first | steps == 0 };
        if !denoising {
            return Err(ImageError::Denoising);
        }
        if self.obs_len() == 0 || self.act_len() == 0 || self.op_count() == 0 {
            return Err(ImageError::Shape);
        }
        // State, observation, operation outputs, action, what is kept with it, work area: in this order and without
        // gaps. (`check_sections` checks the middle.)
        let work = self.work();
        if self.state().offset != 0
            || cfg!(not(feature = "attention")) && self.observation().offset != self.state().end()
            || self.observation().offset < self.state().end()
            || self.output().offset < self.observation().end()
            || work.offset != self.kept().end()
            || work.end() != self.scratch_words()
            || work.end() > h::MAX_SCRATCH
        {
            return Err(ImageError::Arena);
        }
        if !is_positive(self.rate_hz()) {
            return Err(ImageError::Constant);
        }
        // A self-test without steps would report success.
        if self.self_test_steps() == 0 {
            return Err(ImageError::SelfTest);
        }
        self.check_sections()
    }

    /// Checks the sections, in their order in the image, and their content.
    fn check_sections(&self) -> Result<(), ImageError> {
        let front = &mut Front {
            words: self.words,
            at: h::WORDS,
            finite: h::WORDS,
            #[cfg(feature = "attention")]
            prefix: self.prefix().offset,
            #[cfg(feature = "attention")]
            kept: None,
        };
        for i in 0..self.matrix_count() {
            check_matrix(self.matrix_at(i), front)?;
        }
        front.take(self.header.matrices(), self.matrix_count() * h::MATRIX_WORDS)?;
        let mut written = self.observation().end();
        for i in 0..self.op_count() {
            written = self.check_op(i, front, written)?;
        }
        if self.output().end() > written {
            return Err(ImageError::Unwritten);
        }
        if written != self.action().offset {
            return Err(ImageError::Arena);
        }
        #[cfg(feature = "attention")]
        if front.prefix != self.prefix().end() {
            return Err(ImageError::Arena);
        }
        front.take(self.header.ops(), self.op_count() * h::OP_WORDS)?;
        self.check_contract(front)?;
        let name = front.take(self.header.name(), self.name_len().div_ceil(4))?;
        if !is_text(bytemuck::must_cast_slice(name).get(..self.name_len()).unwrap_or_default()) {
            return Err(ImageError::Name);
        }
        // The arena holds both lengths, so the product fits 32 bits.
        let self_test = self.self_test_steps() * (self.obs_len() + self.act_len());
        front.take_finite(self.header.self_test(), self_test)?;
        if self.has_ports() { self.check_ports(front) } else { Ok(()) }
    }

    #[inline(never)]
    fn check_ports(&self, front: &mut Front<'a>) -> Result<(), ImageError> {
        front.take(self.ports_at(), 1)?;
        front.take(self.ports_at() + 1, self.port_words() - 1)?;
        let [inputs, outputs] = self.port_counts();
        let (mut lens, mut list, mut listed) = ([0usize; 2], 0, 0);
        for i in 0..inputs + outputs {
            let [name, words, names] = self.port_texts(i);
            front.take(name, words)?;
            let port = self.port_without_names(i).ok_or(ImageError::Ports)?;
            // A port without a list of its own may name that of an earlier port, the last that there was. A list is
            // read once, so that the time is linear in the image's length.
            if names != 0 && names != list {
                front.take(names, 1)?;
                front.take(names + 1, (self.word(names) as usize).div_ceil(4))?;
                (list, listed) = (names, port.len);
                self.names(names, listed).ok_or(ImageError::Ports)?;
            }
            if names != 0 && port.len != listed {
                return Err(ImageError::Ports);
            }
            let is_output = i >= inputs;
            let [low, high] = port.range;
            if is_output == (port.kind == PortKind::Input) || low > high || low.is_nan() || high.is_nan() || words == 0
            {
                return Err(ImageError::Ports);
            }
            let sum = &mut lens[usize::from(is_output)];
            *sum = sum.saturating_add(port.len);
        }
        if lens == [self.obs_len(), self.act_len()] { Ok(()) } else { Err(ImageError::Ports) }
    }

    fn check_contract(&self, front: &mut Front<'a>) -> Result<(), ImageError> {
        if (ARRAY_BINARISE + 1..CONTRACT_ARRAYS).any(|i| self.has_contract(i) != self.has_contract(ARRAY_BINARISE)) {
            return Err(ImageError::Binarise);
        }
        let (arrays, horizon) = (self.contract_count() * self.act_len(), self.horizon());
        front.take_finite(self.header.contract(), arrays + 2 * horizon)?;
        for i in 0..self.act_len() {
            let [_, _, low, high, max_step, smoothing, on, off, _, _] = self.contract_of(i);
            if low > high {
                return Err(ImageError::Limits);
            }
            if max_step < 0.0 {
                return Err(ImageError::Constant);
            }
            if smoothing <= 0.0 || smoothing > 1.0 {
                return Err(ImageError::Smoothing);
            }
            if off > on {
                return Err(ImageError::Binarise);
            }
        }
        // The ensemble's weights and the reciprocals of their sums follow the arrays.
        let ensemble = self.section(self.header.contract().wrapping_add(arrays), 2 * horizon);
        if !ensemble.iter().all(|word| is_positive(f32::from_bits(u32::from_le(*word)))) {
            return Err(ImageError::Constant);
        }
        Ok(())
    }

    /// Checks operation `i`, before which the step has written the first `written` words of the arena; returns their
    /// number after it.
    #[inline(never)]
    fn check_op(&self, i: usize, front: &mut Front<'a>, written: usize) -> Result<usize, ImageError> {
        let op = self.op(i);
        let op = op.as_ref().map_err(|e| *e)?;
        let Uses { max_detail, constants, arrays, .. } = &op.form.uses;
        let [head, rest @ ..] = op.record.map(u32::from_le);
        let n = op.dst().len;
        if op.form.has_unused(rest) || (head >> 8) as u8 > *max_detail {
            return Err(ImageError::Reserved);
        }
        if n == 0 {
            return Err(ImageError::Shape);
        }
        let [dst, mut src, third] = op.regions;
        if let OpKind::Linear { in_place, .. } = op.kind {
            let distance = op.data().wrapping_sub(self.matrix_at(0));
            if !distance.is_multiple_of(h::MATRIX_WORDS) || distance / h::MATRIX_WORDS >= self.matrix_count() {
                return Err(ImageError::Matrix);
            }
            // The matrix itself was checked with the others.
            if low(self.word(op.data())) != n {
                return Err(ImageError::Shape);
            }
            src = self.check_product(op, in_place)?;
            if op.bias() != 0 {
                front.take_finite(op.bias(), n)?;
            }
        } else if op.kind.is_of_step() {
            self.check_denoising(i, op, front)?;
        } else if op.kind == OpKind::Noise {
            // The head's caller may fill it before the first operation, once a step.
            if i != 0 || self.first_denoising_op() == 0 {
                return Err(ImageError::Denoising);
            }
        } else if op.kind.is_attention() {
            #[cfg(feature = "attention")]
            self.check_attention(op, front)?;
        } else if let Some(kind) = op.kind.around() {
            check_around(kind, op, front)?;
        } else if *constants > 0 {
            let [constants, arrays] = [*constants, *arrays].map(usize::from);
            for constant in front.constants(op.data(), constants)? {
                if !op.kind.takes(u32::from_le(*constant)) {
                    return Err(ImageError::Constant);
                }
            }
            front.take_finite(op.data() + constants, arrays * n)?;
        }
        #[cfg(feature = "attention")]
        self.check_prefix(op, front)?;
        if dst.overlaps(src) || dst.overlaps(third) || op.src().overlaps(third) {
            return Err(ImageError::Overlap);
        }
        // An operation reads only words that this step has written: not what an earlier step or the caller put there,
        // nor the work area, whose content differs between backends.
        let third = if op.is_linear() { Region::default() } else { third };
        let old = if op.reads_dst() { dst.end() } else { 0 };
        if op.src().end().max(third.end()).max(old) > written {
            return Err(ImageError::Unwritten);
        }
        if dst.offset > written {
            return Err(ImageError::Arena);
        }
        Ok(written.max(dst.end()))
    }

    /// Checks that a linear operation's work area has room for its prepared input and its tables, or if it is prepared in place,
    /// that its own words have. Returns the words of its input that its output must not touch.
    #[inline(never)]
    fn check_product(&self, op: &Op<'_>, in_place: bool) -> Result<Region, ImageError> {
        let matrix = op.linear_matrix();
        let matrix = matrix.as_ref().map_err(|e| *e)?;
        let input = op.input();
        for record in matrix.records.as_chunks().0 {
            let rows = row_block(matrix, record, 0);
            let plan = Plan::of(&rows.as_ref().map_err(|e| *e)?.block);
            let own = if in_place { plan.words() } else { 0 };
            let fits = !in_place || plan.fits_in_place() && matrix.block_count() == 1;
            if !fits || own > input.len || plan.work(matrix.cols) - own > self.work().len {
                return Err(ImageError::Arena);
            }
        }
        // The output may begin in its input only if every row is written once, in order, and after the input is prepared.
        Ok(if in_place && matrix.start_values(op.reads_dst()).is_some() { input } else { op.src() })
    }

    /// Checks that an operation has no word of the prefix, or that it is an attention to the next cache of it, or writes the
    /// network's own tokens to that cache before.
    #[cfg(feature = "attention")]
    #[inline(never)]
    fn check_prefix(&self, op: &Op<'_>, front: &mut Front<'a>) -> Result<(), ImageError> {
        let (prefix, [dst, src, third]) = (self.prefix(), op.regions);
        let touches = |regions: &[Region]| regions.iter().any(|region| region.overlaps(prefix));
        match op.kind {
            OpKind::Keep if op.cache().own > 0 => {
                let is_next = dst.offset == front.prefix && dst.end() <= prefix.end() && front.kept.is_none();
                front.kept = Some(op.cache());
                if is_next && !touches(&[src, third]) { Ok(()) } else { Err(ImageError::Overlap) }
            }
            OpKind::Attend if op.reads_prefix(prefix) || op.cache().own > 0 => {
                if third.offset != front.prefix || touches(&[dst, src]) {
                    return Err(ImageError::Overlap);
                }
                front.prefix = third.end();
                let own = Some(op.cache()).filter(|cache| cache.own > 0);
                if front.kept.take() == own { Ok(()) } else { Err(ImageError::Unwritten) }
            }
            _ if touches(&[dst, src, third]) => Err(ImageError::Overlap),
            _ => Ok(()),
        }
    }

    /// Checks an operation of attention: its sizes, and that the work area has room for a head.
    #[cfg(feature = "attention")]
    #[inline(never)]
    fn check_attention(&self, op: &Op<'_>, front: &mut Front<'a>) -> Result<(), ImageError> {
        front.take(op.data(), usize::from(op.form.uses.constants))?;
        if op.kind == OpKind::Rotary {
            let ([heads, dim], len) = (op.rotated_heads(), op.dst().len);
            let token = heads * dim;
            if token == 0 || !dim.is_multiple_of(2) || !len.is_multiple_of(token) {
                return Err(ImageError::Shape);
            }
            front.take_finite(op.data() + 1, len / heads)?;
            return Ok(());
        }
        let (cache, [dst, _, third]) = (op.cache(), op.regions);
        let heads = if op.kind == OpKind::Attend { op.query_heads() } else { cache.heads };
        // With room for a token of a prefix, if there are tokens after it.
        if [heads, cache.heads, cache.dim, cache.prefix_slots()].contains(&0) || !heads.is_multiple_of(cache.heads) {
            return Err(ImageError::Shape);
        }
        if cache.dim > MAX_DIM || cache.slots > MAX_SLOTS {
            return Err(ImageError::Overflow);
        }
        if op.kind == OpKind::Keep {
            if op.is_ring() && cache.own > 0 {
                return Err(ImageError::Reserved);
            }
            // A reset zeroes the tokens of a ring.
            let is_kept = !op.is_ring() || dst.end() <= self.state().end();
            return match dst.len == cache.words() {
                false => Err(ImageError::Shape),
                true if is_kept => Ok(()),
                true => Err(ImageError::Unwritten),
            };
        }
        if op.half(5) != 0 {
            return Err(ImageError::Reserved);
        }
        let (token, most) = (heads * cache.dim, if op.is_causal() { cache.kept() } else { dst.len });
        if !dst.len.is_multiple_of(token) || dst.len > most.saturating_mul(token) || third.len > h::MAX_SCRATCH {
            return Err(ImageError::Shape);
        }
        if !is_positive(op.score_factor()) {
            return Err(ImageError::Constant);
        }
        if cache.work_words() > self.work().len { Err(ImageError::Arena) } else { Ok(()) }
    }

    /// Checks an operation that differs between denoising steps: it is one that these run, with constants for each.
    #[inline(never)]
    fn check_denoising(&self, i: usize, op: &Op<'_>, front: &mut Front<'a>) -> Result<(), ImageError> {
        let (n, steps) = (op.dst().len, self.denoising_steps());
        if i < self.first_denoising_op() || !self.kind().is_iterative() {
            return Err(ImageError::Denoising);
        }
        if op.kind == OpKind::Table {
            return front.take_finite(op.data(), steps * n);
        }
        let [limit, noise] = *front.take(op.data(), h::DENOISE_WORDS)? else { return Err(ImageError::Section) };
        let limit = f32::from_bits(u32::from_le(limit));
        if limit != f32::INFINITY && !is_positive(limit) {
            return Err(ImageError::Constant);
        }
        // Noise of every step, after the noise that the first step starts from.
        let noise = Region { offset: u32::from_le(noise) as usize, len: steps * n };
        let all = self.noise();
        if noise.offset != 0
            && (noise.offset < all.offset || noise.offset > all.end() || all.end() - noise.offset < noise.len)
        {
            return Err(ImageError::Denoising);
        }
        front.take_finite(op.data() + h::DENOISE_WORDS, steps * h::COEFFICIENTS)?;
        // Without noise of its own no step adds any; with it, the noise is none of the values that the operation reads.
        let sigma = |step| op.constant(h::DENOISE_WORDS + step * h::COEFFICIENTS + h::SIGMA);
        let adds = noise.offset == 0 && (0..steps).any(|step| sigma(step) != 0.0);
        if adds || noise.offset != 0 && op.regions.iter().any(|region| noise.overlaps(*region)) {
            return Err(ImageError::Denoising);
        }
        Ok(())
    }
}

/// Checks the data of an operation around a network.
#[inline(never)]
fn check_around(kind: Around, op: &Op<'_>, front: &mut Front<'_>) -> Result<(), ImageError> {
    let n = op.dst().len;
    let valid = match kind {
        Around::Select => {
            front.take(op.data(), 1 + n.div_ceil(2))?;
            (op.half(1) == 0 || op.half(1) == 1 && op.half(0) == 4) && (0..n).all(|i| op.half(2 + i) < op.half(0))
        }
        Around::Constant | Around::Initial => {
            front.take_finite(op.data(), n)?;
            true
        }
        Around::TableRow => {
            let rows = op.half(0);
            front.take(op.data(), 2)?;
            front.take_finite(op.data() + 2, rows * n)?;
            op.half(1) < rows && op.half(2) < rows && op.half(3) == 0
        }
        Around::Standstill => {
            let groups = op.half(1);
            front.take(op.data(), 2)?;
            front.take_finite(op.data() + 2, n)?;
            front.take(op.data() + 2 + n, groups.div_ceil(2))?;
            let sum: usize = (0..groups).map(|group| op.half(2 * (2 + n) + group)).sum();
            sum == op.half(0) && is_positive(op.constant(1))
        }
        Around::History => {
            front.take(op.data(), 3)?;
            let [frame, slots, length, stride, newest, flags] = [0, 1, 2, 3, 4, 5].map(|i| op.half(i));
            // The ring has the oldest frame. The products of two u16 and their sum fit 32 bits.
            let oldest = length.saturating_sub(1) * stride + newest;
            n == frame * length && stride > 0 && newest < 2 && flags < 4 && slots == oldest.max(1)
        }
        // It has no data.
        Around::Clip => true,
    };
    if valid { Ok(()) } else { Err(ImageError::Around) }
}

/// Checks the matrix of the record at `at`: its blocks, their rows' outputs and their sums.
#[inline(never)]
fn check_matrix(at: usize, front: &mut Front<'_>) -> Result<(), ImageError> {
    let matrix = &matrix(front.words, at, 0);
    let matrix = matrix.as_ref().map_err(|e| *e)?;
    let mut seen = [0u32; h::MAX_ROWS / 32];
    let mut first_row = 0;
    // An input is prepared once for all blocks of a width, so they have one layout.
    #[cfg(any(feature = "scalar", feature = "helium"))]
    let mut lanes = [None; 16];
    for record in matrix.records.as_chunks().0 {
        let rows = row_block(matrix, record, first_row);
        let rows = rows.as_ref().map_err(|e| *e)?;
        #[cfg(any(feature = "scalar", feature = "helium"))]
        {
            let shape = rows.block.shape();
            let known = lanes.get_mut(shape.width.bits() as usize).ok_or(ImageError::Width)?;
            if *known.get_or_insert(shape.lanes) != shape.lanes {
                return Err(ImageError::Lanes);
            }
        }
        // Weights, scales and output steps follow each other.
        let [_, weights, scales, steps] = record.map(|word| u32::from_le(word) as usize);
        let to_scales = rows.block.words().len();
        let to_steps = to_scales + rows.scales.len();
        if scales != weights + to_scales || steps != 0 && steps != weights + to_steps {
            return Err(ImageError::Section);
        }
        front.take(weights, to_steps + rows.steps.len())?;
        // Magnitudes compare as their bits; a sign bit is above all of them.
        if bytemuck::must_cast_slice(rows.scales).iter().any(|scale: &u16| u16::from_le(*scale) >= BF16_INFINITY) {
            return Err(ImageError::Constant);
        }
        first_row += rows.block.shape().rows;
        for output in rows.outputs() {
            let word = seen.get_mut(output / 32).ok_or(ImageError::Index)?;
            if output >= matrix.rows || *word >> (output % 32) & 1 == 1 {
                return Err(ImageError::Index);
            }
            *word |= 1 << (output % 32);
        }
        if !fits_i32(&rows.block, matrix.x_max) {
            return Err(ImageError::Overflow);
        }
    }
    front.take(word(front.words, at + 3) as usize, matrix.records.len())?;
    Ok(())
}

/// Returns `true` if a number is above 0 and finite.
fn is_positive(x: f32) -> bool {
    (1..f32::INFINITY.to_bits()).contains(&x.to_bits())
}
