//! The products of attention in assembler: see `arch/portable/attention.rs`.

assembler!("attention.s");

unsafe extern "C" {
    fn actq_query_keys(keys: *const u32, query: *const u32, sums: *mut u32, count: usize, bytes: usize, next: usize);
    fn actq_weigh_values(
        values: *const u32,
        weights: *const u32,
        sums: *mut u32,
        fours: usize,
        row_bytes: usize,
        weight_bytes: usize,
    );
}

/// Computes the products of a query with keys, one for each of `sums`. It does nothing if a length does not fit.
pub(crate) fn query_keys(keys: &[u32], query: &[u32], sums: &mut [u32]) {
    let (words, bytes) = (query.len() / 2, 2 * query.len());
    let needed = words.checked_mul(sums.len());
    if words == 0 || !query.len().is_multiple_of(4) || needed.is_none_or(|needed| needed > keys.len()) {
        return;
    }
    let (pairs, last) = sums.as_chunks_mut::<2>();
    // SAFETY: the keys have `words` words for each sum, and the query has two for each of these, a multiple of 4. The
    // kernel reads as many keys as it is told, from the first on; for a last one, both keys of two are that one. It
    // writes as many sums.
    unsafe {
        if !pairs.is_empty() {
            let sums = pairs.as_mut_ptr().cast();
            actq_query_keys(keys.as_ptr(), query.as_ptr(), sums, 2 * pairs.len(), bytes, bytes);
        }
        if let [last] = last {
            let mut twice = [0; 2];
            let key = keys.as_ptr().add(2 * pairs.len() * words);
            actq_query_keys(key, query.as_ptr(), twice.as_mut_ptr(), 2, bytes, 0);
            [*last, _] = twice;
        }
    }
}

/// Computes the sums of values times weights, one for each column. It does nothing if a length does not fit.
pub(crate) fn weigh_values(values: &[u32], row_words: usize, weights: &[u32], sums: &mut [u32]) {
    let rows = 2 * sums.len().div_ceil(4);
    let needed = rows.checked_mul(row_words);
    let fits = weights.len() <= row_words && needed.is_some_and(|needed| needed <= values.len());
    if weights.is_empty() || !weights.len().is_multiple_of(4) || !fits {
        return;
    }
    let (row, bytes) = (size_of::<u32>() * row_words, size_of_val(weights));
    let (fours, last) = sums.as_chunks_mut::<4>();
    // SAFETY: the values have two rows of `row_words` words for every four columns, also if these are not whole, and the
    // kernel reads as many words of a row as there are weights, a multiple of 4. It writes four sums for two rows.
    unsafe {
        if !fours.is_empty() {
            let sums = fours.as_mut_ptr().cast();
            actq_weigh_values(values.as_ptr(), weights.as_ptr(), sums, fours.len(), row, bytes);
        }
        if !last.is_empty() {
            let mut four = [0; 4];
            let rows = values.as_ptr().add(2 * fours.len() * row_words);
            actq_weigh_values(rows, weights.as_ptr(), four.as_mut_ptr(), 1, row, bytes);
            last.iter_mut().zip(four).for_each(|(sum, four)| *sum = four);
        }
    }
}
