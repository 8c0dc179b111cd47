//! Rotary positions of queries and keys, which exporters write as a sum of products with cosines and sines.

use std::collections::{BTreeMap, HashMap};

use crate::values::compare::near;
use crate::values::elements::value;
use crate::values::expr::{Expr, Exprs, Id, Rotary, Run};

/// An element of a sum, `cos x_p + sin x_q` of elements `p` and `q` of one value.
#[derive(Clone, Copy)]
struct Rotated {
    cos: f64,
    sin: f64,
    q: usize,
    /// Index in the sum.
    index: usize,
}

/// A head's elements of a value from `start` on, and its angles.
struct RotatedHead {
    of: Id,
    start: usize,
    cos: Vec<f64>,
    sin: Vec<f64>,
}

impl RotatedHead {
    fn len(&self) -> usize {
        2 * self.cos.len()
    }

    /// Returns `true` if `other` has the same angles.
    fn is_like(&self, other: &Self) -> bool {
        let equal = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| near(*a, *b));
        self.of == other.of && equal(&self.cos, &other.cos) && equal(&self.sin, &other.sin)
    }
}

impl Exprs {
    /// Returns queries or keys with an expression of its own for each rotation of heads by positions.
    pub(crate) fn rotated(&mut self, id: Id) -> Id {
        let elements: Vec<(Id, usize)> = self.elements(id).iter().filter_map(value).collect();
        let mut rotations: HashMap<Id, Option<Vec<(Id, usize)>>> = HashMap::new();
        for (sum, _) in &elements {
            if !rotations.contains_key(sum) {
                let rotation = self.rotation(*sum);
                rotations.insert(*sum, rotation);
            }
        }
        if elements.len() < self.len_of(id) || rotations.values().all(Option::is_none) {
            return id;
        }
        let place = |&(of, i): &(Id, usize)| match rotations.get(&of) {
            Some(Some(places)) => places[i],
            _ => (of, i),
        };
        let elements: Vec<(Id, usize)> = elements.iter().map(place).collect();
        self.vector(&elements)
    }

    /// Returns the place of every element of a sum in rotations that give the same; `None` if it is no rotation.
    fn rotation(&mut self, sum: Id) -> Option<Vec<(Id, usize)>> {
        let &Expr::Add(x, y) = self.get(sum) else { return None };
        let heads = self.rotated_heads(x, y).or_else(|| self.rotated_heads(y, x))?;
        let (mut rest, mut places) = (&heads[..], vec![(0, 0); self.len_of(sum)]);
        while let [(first, _), ..] = rest {
            let follows = |(i, (head, _)): &(usize, &(RotatedHead, Vec<usize>))| {
                first.is_like(head) && head.start == first.start + i * first.len()
            };
            let count = rest.iter().enumerate().take_while(follows).count();
            let len = count * first.len();
            let all: Vec<(Id, usize)> = (first.start..first.start + len).map(|i| (first.of, i)).collect();
            let rotary = Rotary { x: self.vector(&all), heads: count, cos: first.cos.clone(), sin: first.sin.clone() };
            let rotary = self.put(Expr::Rotary(Box::new(rotary)), len);
            for (i, index) in rest[..count].iter().flat_map(|(_, indices)| indices).enumerate() {
                places[*index] = (rotary, i);
            }
            rest = &rest[count..];
        }
        Some(places)
    }

    /// Returns the heads that a sum of terms with cosines and terms with sines rotates, in the order of their values, with
    /// the indices of their elements in the sum.
    fn rotated_heads(&self, cosines: Id, sines: Id) -> Option<Vec<(RotatedHead, Vec<usize>)>> {
        let mut elements: BTreeMap<(Id, usize), Rotated> = BTreeMap::new();
        let pairs = self.parts(cosines).into_iter().zip(self.parts(sines));
        for (index, (cosine, sine)) in pairs.enumerate() {
            let [p, q]: [Run; 2] = [cosine.source?.run(1)?, sine.source?.run(1)?];
            let rotated = Rotated { cos: cosine.factor, sin: sine.factor, q: q.from, index };
            let is_first = elements.insert((p.of, p.from), rotated).is_none();
            if !is_first || p.of != q.of || cosine.offset != 0.0 || sine.offset != 0.0 {
                return None;
            }
        }
        let mut heads = Vec::new();
        while let Some((&(of, start), first)) = elements.first_key_value() {
            let half = first.q.checked_sub(start).filter(|half| *half > 0)?;
            let of_half = |elements: &mut BTreeMap<_, Rotated>, from: usize, to: usize| -> Option<Vec<Rotated>> {
                let all = (0..half).map(|i| elements.remove(&(of, from + i)).filter(|rotated| rotated.q == to + i));
                all.collect()
            };
            let first = of_half(&mut elements, start, start + half)?;
            let second = of_half(&mut elements, start + half, start)?;
            let is_rotation = |(a, b): (&Rotated, &Rotated)| near(a.cos, b.cos) && near(a.sin, -b.sin);
            if !first.iter().zip(&second).all(is_rotation) {
                return None;
            }
            let (cos, sin) = second.iter().map(|element| (element.cos, element.sin)).unzip();
            let indices = first.iter().chain(&second).map(|element| element.index).collect();
            heads.push((RotatedHead { of, start, cos, sin }, indices));
        }
        Some(heads)
    }
}
