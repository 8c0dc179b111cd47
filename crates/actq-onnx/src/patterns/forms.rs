//! Values as sums of matrix products, and recognition of cells that an exporter decomposed.

use std::sync::Arc;

use actq_kernels::math::Function;

use crate::values::expr::{Cell, Expr, Exprs, Id, Matrix, Run};
use crate::values::tensor::Element;

/// The most nested expressions of a gate.
const DEPTH: usize = 8;

/// `sum of matrix x operand + bias`; the matrices are row-major with a row for each element.
struct Form {
    terms: Vec<(Id, Vec<Vec<f64>>)>,
    bias: Vec<f64>,
}

/// Input of a cell's gates, the matrices of the input and of the state, and the biases.
type Gates = (Id, Arc<Matrix>, Arc<Matrix>, Vec<f64>);

/// A recognized cell.
pub(crate) struct Found {
    pub(crate) cell: Cell,
    /// The expression of an LSTM's cell state after the step.
    pub(crate) next_c: Option<Id>,
}

impl Exprs {
    fn form(&self, id: Id) -> Option<Form> {
        self.form_within(id, DEPTH)
    }

    fn form_within(&self, id: Id, depth: usize) -> Option<Form> {
        let depth = depth.checked_sub(1)?;
        match self.get(id) {
            Expr::Linear(x, w, b) => {
                Some(Form { terms: vec![(*x, w.data.chunks(w.cols).map(<[f64]>::to_vec).collect())], bias: b.clone() })
            }
            Expr::Affine(x, a, b) => {
                let mut form = self.form_within(*x, depth)?;
                for (_, rows) in &mut form.terms {
                    rows.iter_mut().zip(a).for_each(|(row, a)| row.iter_mut().for_each(|w| *w *= a));
                }
                form.bias = form.bias.iter().zip(a).zip(b).map(|((bias, a), b)| bias * a + b).collect();
                Some(form)
            }
            Expr::Add(x, y) => {
                let (x, y) = (self.form_within(*x, depth)?, self.form_within(*y, depth)?);
                let bias = x.bias.iter().zip(&y.bias).map(|(x, y)| x + y).collect();
                Some(Form { terms: [x.terms, y.terms].concat(), bias })
            }
            Expr::Pick(runs) => {
                let &[Run { of, from, len }] = &runs[..] else { return None };
                let form = self.form_within(of, depth)?;
                let cut = |(x, rows): &(Id, Vec<Vec<f64>>)| Some((*x, rows.get(from..from + len)?.to_vec()));
                let terms = form.terms.iter().map(cut).collect::<Option<Vec<_>>>()?;
                Some(Form { terms, bias: form.bias.get(from..from + len)?.to_vec() })
            }
            _ => None,
        }
    }

    /// Returns the run of a graph input that an expression is.
    fn input_run(&self, id: Id) -> Option<Run> {
        crate::nodes::cells::run_of_input(self, &self.elements(id))
    }

    fn product(&self, id: Id) -> Option<(Id, Id)> {
        if let &Expr::Mul(x, y) = self.get(id) { Some((x, y)) } else { None }
    }

    fn sum_of(&self, id: Id) -> Option<(Id, Id)> {
        if let &Expr::Add(x, y) = self.get(id) { Some((x, y)) } else { None }
    }

    /// Finds the LSTM whose hidden state after the step is `next`: `o tanh(c')` with `c' = f c + i g`. The state before
    /// the step is one of `candidates`, the one of the least rank.
    ///
    /// # Errors
    ///
    /// The two runs of a rank that may both be that state: the graph is the same with either.
    pub(crate) fn lstm_of(&mut self, next: Id, candidates: &[(usize, Run)]) -> Result<Option<Found>, [Run; 2]> {
        let Some((gates, c, next_c)) = self.lstm_gates(next) else { return Ok(None) };
        let hidden = self.len_of(next);
        let mut fitting = candidates
            .iter()
            .filter(|(_, run)| run.len == hidden && *run != c && gates.iter().all(|gate| self.reads(gate, run)));
        let Some(&(rank, h)) = fitting.next() else { return Ok(None) };
        if let Some(&(_, other)) = fitting.find(|(other, _)| *other == rank) {
            return Err([h, other]);
        }
        let Some((x, w_ih, w_hh, bias)) = self.gates(&gates, h) else { return Ok(None) };
        let b_hh = vec![0.0; bias.len()];
        let cell = Cell { lstm: true, x, w_ih, w_hh, b_ih: bias, b_hh, states: vec![h, c] };
        Ok(Some(Found { cell, next_c: Some(next_c) }))
    }

    /// Returns an LSTM's gates i, f, g, o, its cell state, and the expression of the next one.
    fn lstm_gates(&mut self, next: Id) -> Option<(Vec<Form>, Run, Id)> {
        let both = |(x, y): (Id, Id)| [(x, y), (y, x)];
        let (o, next_c) = both(self.product(next)?)
            .into_iter()
            .find_map(|(o, t)| Some((self.known_of(o, Function::Sigmoid)?, self.known_of(t, Function::Tanh)?)))?;
        let (i, f, g, c) = both(self.sum_of(next_c)?).into_iter().find_map(|(kept, new)| {
            let (f, c) = both(self.product(kept)?)
                .into_iter()
                .find_map(|(f, c)| Some((self.known_of(f, Function::Sigmoid)?, self.input_run(c)?)))?;
            let (i, g) = both(self.product(new)?)
                .into_iter()
                .find_map(|(i, g)| Some((self.known_of(i, Function::Sigmoid)?, self.known_of(g, Function::Tanh)?)))?;
            Some((i, f, g, c))
        })?;
        let gates = [i, f, g, o].map(|gate| self.form(gate));
        Some((gates.into_iter().collect::<Option<_>>()?, c, next_c))
    }

    /// Finds the GRU whose state after the step is `next`: `(1 - z) n + z h` with `n = tanh(input + r (W h + b))`.
    pub(crate) fn gru_of(&mut self, next: Id) -> Option<Found> {
        let (z, n, h) = self.mixed(next)?;
        let (x, y) = self.sum_of(self.known_of(n, Function::Tanh)?)?;
        let (r, of_input, of_state) = [(x, y), (y, x)].into_iter().find_map(|(of_input, gated)| {
            let (p, q) = self.product(gated)?;
            let (r, of_state) = [(p, q), (q, p)]
                .into_iter()
                .find_map(|(r, s)| Some((self.known_of(r, Function::Sigmoid)?, self.form(s)?)))?;
            Some((r, self.form(of_input)?, of_state))
        })?;
        let gates = vec![self.form(r)?, self.form(z)?, of_input];
        // The two halves of the new gate stay separate: one reads the input only, the other the state only.
        if of_state.terms.iter().any(|(x, _)| self.input_run(*x) != Some(h)) || self.reads(&gates[2], &h) {
            return None;
        }
        let hidden = h.len;
        let (x, w_ih, w_hh, b_ih) = self.gates(&gates, h)?;
        let mut data = w_hh.data.clone();
        for (_, rows) in &of_state.terms {
            let flat = rows.iter().flatten();
            data[2 * hidden * hidden..].iter_mut().zip(flat).for_each(|(to, from)| *to += from);
        }
        let w_hh = Arc::new(Matrix { name: None, rows: 3 * hidden, cols: hidden, data });
        let b_hh = [vec![0.0; 2 * hidden], of_state.bias].concat();
        Some(Found { cell: Cell { lstm: false, x, w_ih, w_hh, b_ih, b_hh, states: vec![h] }, next_c: None })
    }

    /// Finds the update gate's operand, the new value and the old state of `(1 - z) n + z h` or `n + z (h - n)`, also
    /// with `1 - z` as the gate.
    fn mixed(&mut self, next: Id) -> Option<(Id, Id, Run)> {
        let (x, y) = self.sum_of(next)?;
        for (x, y) in [(x, y), (y, x)] {
            // n + z (h - n), and h + u (n - h) with u = 1 - z.
            if let Some((p, q)) = self.product(y) {
                for (gate, difference) in [(p, q), (q, p)] {
                    let Some(a) = self.known_of(gate, Function::Sigmoid) else { continue };
                    let Some((d, e)) = self.sum_of(difference) else { continue };
                    for (plus, minus) in [(d, e), (e, d)] {
                        if self.ratio(minus, x) != Some(-1.0) {
                            continue;
                        }
                        if let Some(h) = self.input_run(plus) {
                            return Some((a, x, h));
                        }
                        if let Some(h) = self.input_run(x) {
                            return Some((self.scaled(a, -1.0, 0.0), plus, h));
                        }
                    }
                }
            }
            // (1 - z) n + z h
            let (Some((p, q)), Some((s, t))) = (self.product(x), self.product(y)) else { continue };
            for (first, n) in [(p, q), (q, p)] {
                for (second, h) in [(s, t), (t, s)] {
                    let Some(h) = self.input_run(h) else { continue };
                    if let Some(z) = self.known_of(second, Function::Sigmoid)
                        && self.affine_of(first) == (second, -1.0, 1.0)
                    {
                        return Some((z, n, h));
                    }
                    if let Some(u) = self.known_of(first, Function::Sigmoid)
                        && self.affine_of(second) == (first, -1.0, 1.0)
                    {
                        return Some((self.scaled(u, -1.0, 0.0), n, h));
                    }
                }
            }
        }
        None
    }

    /// Returns `true` if a form reads elements of a run.
    fn reads(&self, form: &Form, run: &Run) -> bool {
        let of_run = |e: &Element| matches!(e, Element::Of(of, i) if *of == run.of && (run.from..run.from + run.len).contains(i));
        form.terms.iter().any(|(x, _)| self.elements(*x).iter().any(of_run))
    }

    /// Concatenates the gates: returns their input, the matrices of the input and of the state, and the biases.
    fn gates(&mut self, gates: &[Form], h: Run) -> Option<Gates> {
        // Every element that a gate reads apart from the state, without duplicates.
        let mut read: Vec<(Id, usize)> = Vec::new();
        let mut place: std::collections::HashMap<(Id, usize), usize> = std::collections::HashMap::new();
        let in_state = |of: Id, i: usize| of == h.of && (h.from..h.from + h.len).contains(&i);
        let mut terms = Vec::new();
        for gate in gates {
            for (x, rows) in &gate.terms {
                let elements = self
                    .elements(*x)
                    .into_iter()
                    .map(|e| if let Element::Of(of, i) = e { Some((of, i)) } else { None });
                let elements: Vec<(Id, usize)> = elements.collect::<Option<_>>()?;
                for &(of, i) in elements.iter().filter(|(of, i)| !in_state(*of, *i)) {
                    place.entry((of, i)).or_insert_with(|| {
                        read.push((of, i));
                        read.len() - 1
                    });
                }
                terms.push((elements, rows));
            }
        }
        let hidden = h.len;
        let (rows, cols) = (gates.len() * hidden, read.len());
        if cols == 0 || gates.iter().any(|gate| gate.bias.len() != hidden) {
            return None;
        }
        let (mut w_ih, mut w_hh) = (vec![0.0; rows * cols], vec![0.0; rows * hidden]);
        let mut next = terms.iter();
        for (g, gate) in gates.iter().enumerate() {
            for (elements, weights) in next.by_ref().take(gate.terms.len()) {
                for (k, row) in weights.iter().enumerate() {
                    for (&(of, i), w) in elements.iter().zip(row) {
                        let row = g * hidden + k;
                        match place.get(&(of, i)) {
                            Some(col) => w_ih[row * cols + col] += w,
                            None => w_hh[row * hidden + i - h.from] += w,
                        }
                    }
                }
            }
        }
        let bias = gates.iter().flat_map(|gate| gate.bias.iter().copied()).collect();
        let matrix = |cols: usize, data: Vec<f64>| Arc::new(Matrix { name: None, rows, cols, data });
        Some((self.vector(&read), matrix(cols, w_ih), matrix(hidden, w_hh), bias))
    }
}
