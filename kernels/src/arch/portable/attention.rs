//! The products of attention ([`crate::ops::attention`]). A lane of 16 bits holds two columns, `even + 256 odd`.

/// Adds the products of both lanes.
#[inline(always)]
fn multiply(sum: i32, a: u32, b: u32) -> i32 {
    let lane = |word: u32, shift: u32| i32::from((word >> shift) as i16);
    let products = (lane(a, 0) * lane(b, 0)).wrapping_add(lane(a, 16) * lane(b, 16));
    sum.wrapping_add(products)
}

/// Returns the even column of both lanes.
#[inline(always)]
fn even(word: u32) -> u32 {
    let column = |shift: u32| i32::from((word >> shift) as i8) as u32;
    column(0) & 0xffff | column(16) << 16
}

/// Computes the products of a query with keys, one for each of `sums`. Two words of the query belong to a word of a key:
/// its odd columns, and 256 times its even columns minus the odd ones. So the sum is 256 times the product.
pub fn query_keys(keys: &[u32], query: &[u32], sums: &mut [u32]) {
    let query = query.as_chunks::<2>().0;
    for (sum, key) in sums.iter_mut().zip(keys.chunks_exact(query.len().max(1))) {
        let products = key
            .iter()
            .zip(query)
            .fold(0, |sum, (key, [odd, rest])| multiply(multiply(sum, *key, *odd), even(*key), *rest));
        *sum = (products >> 8) as u32;
    }
}

/// Computes the sums of values times weights, one for each column. A row of `row_words` words has two columns of all
/// tokens, a lane each; the weights are in lanes, too, and may be those of the first tokens only.
pub fn weigh_values(values: &[u32], row_words: usize, weights: &[u32], sums: &mut [u32]) {
    for (sums, row) in sums.chunks_mut(2).zip(values.chunks_exact(row_words.max(1))) {
        let (both, low) = row.iter().zip(weights).fold((0, 0), |(both, low), (value, weight)| {
            (multiply(both, *value, *weight), multiply(low, even(*value), *weight))
        });
        for (sum, product) in sums.iter_mut().zip([low, both.wrapping_sub(low) >> 8]) {
            *sum = product as u32;
        }
    }
}
