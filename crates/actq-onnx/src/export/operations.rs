//! The operations of an image as nodes.

use actq::error::{Result, bail, ensure};
use actq::measure::unrounded::dequantized;
use actq_kernels::Image;
use actq_kernels::image::{Matrix, Op, OpKind, Region};
use actq_kernels::math::Function;
use actq_kernels::ops::denoise::Coefficients;

use super::builder::{Attribute, Builder, Data, Grid, Network, Value};

/// Returns the network of an image with scale, offset and limits of its actions. Denoising steps follow each other.
/// Work of the contract from step to step (step limits, smoothing, switches, playback) is not part of it.
///
/// # Errors
///
/// If the image has operations around its network.
pub fn network(image: &Image<'_>) -> Result<Network> {
    ensure!(!image.has_around(), "an image of raw values has no form in ONNX; export one of its network");
    let mut builder = Builder::new(image.scratch_words());
    builder.input("obs", image.observation());
    let state = image.state();
    if state.len > 0 {
        builder.input("state", state);
    }
    let ops: Vec<Op<'_>> = image.ops().collect();
    for step in 0..image.denoising_steps() {
        let first = if step == 0 { 0 } else { image.first_denoising_op() };
        for (i, op) in ops.iter().enumerate().skip(first) {
            add(&mut builder, first_with_matrix(&ops, i), i, op, step)?;
        }
    }
    let mut action = builder.read(image.output())?;
    let (chunk, act_len) = (image.chunk(), image.act_len());
    if chunk > 1 {
        let shape = builder.integers(&[0, chunk as i64, act_len as i64]);
        action = builder.node("Reshape", &[&action.name, &shape], Vec::new(), action.len);
    }
    let [scale, offset, low, high, ..] = image.contract_arrays();
    for (op, name, array) in
        [("Mul", "scale", scale), ("Add", "offset", offset), ("Max", "low", low), ("Min", "high", high)]
    {
        if !array.is_empty() {
            let array = builder.vector(name.to_owned(), floats(array));
            action = builder.apply(op, &[&action, &array]);
        }
    }
    output(&mut builder, "action", &action, if chunk > 1 { vec![chunk, act_len] } else { vec![act_len] });
    if state.len > 0 {
        let next = builder.read(state)?;
        output(&mut builder, "next_state", &next, vec![state.len]);
    }
    Ok(builder.network)
}

fn output(builder: &mut Builder, name: &str, value: &Value, shape: Vec<usize>) {
    builder.apply("Identity", &[value]);
    if let Some(node) = builder.network.nodes.last_mut() {
        name.clone_into(&mut node.output);
    }
    builder.network.outputs.push((name.to_owned(), shape));
}

fn floats(array: &[u32]) -> Vec<f32> {
    array.iter().map(|word| f32::from_bits(u32::from_le(*word))).collect()
}

/// Returns the first operation with the matrix of operation `i`, which names its weights: operations can share them.
fn first_with_matrix(ops: &[Op<'_>], i: usize) -> usize {
    let words = |op: &Op<'_>| op.matrix().and_then(|matrix| Some(matrix.blocks().next()?.block.words().as_ptr()));
    let matrix = ops.get(i).and_then(words);
    if matrix.is_none() { i } else { ops.iter().position(|op| words(op) == matrix).unwrap_or(i) }
}

/// Adds operation `i` in a denoising step; its weights have the name of operation `named`.
fn add(to: &mut Builder, named: usize, i: usize, op: &Op<'_>, step: usize) -> Result<()> {
    let (dst, src, third) = (op.dst(), op.src(), op.third());
    let value = match op.kind {
        OpKind::Noise => {
            to.input("noise", dst);
            return Ok(());
        }
        OpKind::Normalize { .. } => {
            let x = to.read(src)?;
            let x = clip(to, &x, op.constant(0));
            let mean = to.vector(format!("mean_{i}"), floats(op.array(0)));
            let factor = to.vector(format!("factor_{i}"), floats(op.array(1)));
            let centered = to.apply("Sub", &[&x, &mean]);
            let scaled = to.apply("Mul", &[&centered, &factor]);
            clip(to, &scaled, op.constant(1))
        }
        OpKind::Linear { accumulate, .. } => {
            let product = linear(to, named, i, op)?;
            if accumulate {
                let sum = to.read(dst)?;
                to.apply("Add", &[&sum, &product])
            } else {
                product
            }
        }
        OpKind::Function(function) => {
            let x = to.read(dst)?;
            apply(to, function, &x)
        }
        OpKind::LayerNorm => {
            let x = to.read(dst)?;
            let weight = to.vector(format!("norm_weight_{i}"), floats(op.array(0)));
            let bias = to.vector(format!("norm_bias_{i}"), floats(op.array(1)));
            let attributes = vec![("axis", Attribute::Int(-1)), ("epsilon", Attribute::Float(op.constant(0)))];
            to.node("LayerNormalization", &[&x.name, &weight.name, &bias.name], attributes, x.len)
        }
        OpKind::RmsNorm => {
            let x = to.read(dst)?;
            let weight = to.vector(format!("norm_weight_{i}"), floats(op.array(0)));
            let eps = to.number(op.constant(0));
            let square = to.apply("Mul", &[&x, &x]);
            let axes = vec![("axes", Attribute::Ints(vec![1])), ("keepdims", Attribute::Int(1))];
            let mean = to.node("ReduceMean", &[&square.name], axes, 1);
            let sum = to.apply("Add", &[&mean, &eps]);
            let deviation = to.apply("Sqrt", &[&sum]);
            let normed = to.apply("Div", &[&x, &deviation]);
            to.apply("Mul", &[&normed, &weight])
        }
        OpKind::Add | OpKind::Mul => {
            let (y, x) = (to.read(dst)?, to.read(src)?);
            to.apply(if op.kind == OpKind::Add { "Add" } else { "Mul" }, &[&y, &x])
        }
        OpKind::Copy => to.read(src)?,
        OpKind::Table => {
            let row = to.vector(format!("table_{i}_{step}"), floats(op.array(step)));
            to.repeated(&row)
        }
        OpKind::LstmCell => {
            let (gates, cell) = (to.read(src)?, to.read(third)?);
            let gate = |to: &mut Builder, k: usize, op| {
                let x = to.slice(&gates, k * dst.len, dst.len);
                to.apply(op, &[&x])
            };
            let [i, f, g, o] =
                [(0, "Sigmoid"), (1, "Sigmoid"), (2, "Tanh"), (3, "Sigmoid")].map(|(k, op)| gate(to, k, op));
            let (kept, new) = (to.apply("Mul", &[&f, &cell]), to.apply("Mul", &[&i, &g]));
            let cell = to.apply("Add", &[&kept, &new]);
            to.write(third, cell.clone());
            let bounded = to.apply("Tanh", &[&cell]);
            to.apply("Mul", &[&o, &bounded])
        }
        OpKind::GruCell => {
            let (a, b, h) = (to.read(src)?, to.read(third)?, to.read(dst)?);
            let mut gate = |k: usize| [&a, &b].map(|value| to.slice(value, k * dst.len, dst.len));
            let [r, z, n] = [gate(0), gate(1), gate(2)];
            let [r, z] = [r, z].map(|[a, b]| {
                let sum = to.apply("Add", &[&a, &b]);
                to.apply("Sigmoid", &[&sum])
            });
            let reset = to.apply("Mul", &[&r, &n[1]]);
            let sum = to.apply("Add", &[&n[0], &reset]);
            let new = to.apply("Tanh", &[&sum]);
            // (1 - z) n + z h
            let difference = to.apply("Sub", &[&h, &new]);
            let kept = to.apply("Mul", &[&z, &difference]);
            to.apply("Add", &[&new, &kept])
        }
        OpKind::Denoise => return denoise(to, op, step),
        _ => bail!("operation {i}, {}, has no form in ONNX", op.kind.name()),
    };
    to.write(dst, value);
    Ok(())
}

fn linear(to: &mut Builder, named: usize, i: usize, op: &Op<'_>) -> Result<Value> {
    let x = to.read(op.src())?;
    let Some(matrix) = op.matrix() else { bail!("operation {i} has no matrix") };
    let (rows, cols) = (matrix.rows, matrix.cols);
    let weights = Data::Floats(dequantized(&matrix).into_iter().collect());
    let weights = to.tensor(format!("weight_{named}"), vec![rows, cols], weights);
    if !to.network.grids.iter().any(|grid| grid.weights == weights) {
        to.network.grids.push(grid(weights.clone(), &matrix));
    }
    let bias = to.vector(format!("bias_{i}"), (0..rows).map(|row| matrix.bias(row)).collect());
    let product = to.node("Gemm", &[&x.name, &weights, &bias.name], vec![("transB", Attribute::Int(1))], rows);
    if let Some(node) = to.network.nodes.last_mut() {
        node.x_max = Some(matrix.x_max);
    }
    Ok(product)
}

fn grid(weights: String, matrix: &Matrix<'_>) -> Grid {
    let group = if matrix.group == 0 { matrix.cols } else { matrix.group };
    let groups = matrix.cols.div_ceil(group);
    let (mut steps, mut bits) = (vec![0.0; matrix.rows * groups], vec![0; matrix.rows]);
    for rows in matrix.blocks() {
        for (i, output) in rows.outputs().enumerate() {
            bits[output] = rows.block.shape().width.bits();
            for (at, step) in steps[output * groups..][..groups].iter_mut().enumerate() {
                *step = f32::from(rows.block.group_scale(i, at * group)) * rows.scale(i);
            }
        }
    }
    Grid { weights, steps, group, bits }
}

/// Limits values to both sides of zero, unless the limit is infinite.
fn clip(to: &mut Builder, x: &Value, limit: f32) -> Value {
    if limit.is_infinite() {
        return x.clone();
    }
    let (low, high) = (to.number(-limit), to.number(limit));
    to.apply("Clip", &[x, &low, &high])
}

fn scaled(to: &mut Builder, x: &Value, factor: f32) -> Value {
    let factor = to.number(factor);
    to.apply("Mul", &[x, &factor])
}

fn apply(to: &mut Builder, function: Function, x: &Value) -> Value {
    match function {
        Function::Relu => to.apply("Relu", &[x]),
        Function::Elu => to.apply("Elu", &[x]),
        Function::Tanh => to.apply("Tanh", &[x]),
        Function::Sigmoid => to.apply("Sigmoid", &[x]),
        Function::Exp => to.apply("Exp", &[x]),
        Function::Sin => to.apply("Sin", &[x]),
        Function::Cos => to.apply("Cos", &[x]),
        Function::Softplus => to.apply("Softplus", &[x]),
        Function::Silu => {
            let gate = to.apply("Sigmoid", &[x]);
            to.apply("Mul", &[x, &gate])
        }
        Function::Mish => {
            let softplus = to.apply("Softplus", &[x]);
            let gate = to.apply("Tanh", &[&softplus]);
            to.apply("Mul", &[x, &gate])
        }
        // x (1 + g) / 2
        Function::Gelu | Function::GeluTanh => {
            let gate = if function == Function::Gelu {
                let scaled = scaled(to, x, std::f32::consts::FRAC_1_SQRT_2);
                to.apply("Erf", &[&scaled])
            } else {
                let square = to.apply("Mul", &[x, x]);
                let cube = to.apply("Mul", &[&square, x]);
                let cube = scaled(to, &cube, 0.044_715);
                let sum = to.apply("Add", &[x, &cube]);
                let scaled = scaled(to, &sum, (2.0 / std::f32::consts::PI).sqrt());
                to.apply("Tanh", &[&scaled])
            };
            let one = to.number(1.0);
            let sum = to.apply("Add", &[&gate, &one]);
            let product = to.apply("Mul", &[x, &sum]);
            scaled(to, &product, 0.5)
        }
    }
}

/// Adds a denoising step, with the formula of [`Coefficients`].
fn denoise(to: &mut Builder, op: &Op<'_>, step: usize) -> Result<()> {
    let (by, noise) = op.coefficients(step);
    let by = Coefficients::from_array(by);
    let (x, v) = (to.read(op.dst())?, to.read(op.src())?);
    let sample = sum(to, &[(by.sample_x, &x), (by.sample_v, &v)]);
    let sample = clip(to, &sample, op.constant(0));
    let mut terms = vec![(by.keep, x), (by.direct, v.clone()), (by.sample, sample)];
    if by.sigma != 0.0 {
        let noise = to.read(Region { offset: noise, len: op.dst().len })?;
        terms.push((by.sigma, noise));
    }
    let terms: Vec<(f32, &Value)> = terms.iter().map(|(factor, value)| (*factor, value)).collect();
    let next = sum(to, &terms);
    to.write(op.dst(), next.clone());
    let read = sum(to, &[(1.0, &next), (by.ahead, &v)]);
    to.write(op.third(), read);
    Ok(())
}

/// Returns the sum of values times factors; factors of 0 leave their values out, but for the last.
fn sum(to: &mut Builder, terms: &[(f32, &Value)]) -> Value {
    let mut used: Vec<&(f32, &Value)> = terms.iter().filter(|(factor, _)| *factor != 0.0).collect();
    if used.is_empty() {
        used.extend(terms.last());
    }
    let mut terms: Vec<Value> = Vec::new();
    for (factor, value) in used {
        terms.push(if *factor == 1.0 { (*value).clone() } else { scaled(to, value, *factor) });
    }
    terms
        .into_iter()
        .reduce(|sum, term| to.apply("Add", &[&sum, &term]))
        .unwrap_or(Value { name: String::new(), len: 0 })
}
