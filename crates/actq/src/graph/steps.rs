//! The operations that a network's nodes become.

use super::lowering::{Buffer, Lowering, Slice, Step};
use super::{Graph, Node};

/// Returns how many nodes read each value; the network's output counts as one more.
pub fn readers(graph: &Graph) -> Vec<usize> {
    let mut readers = vec![0; graph.nodes.len() + 1];
    readers[graph.output()] = 1;
    for &value in graph.nodes.iter().flat_map(|node| &node.inputs) {
        readers[value] += 1;
    }
    readers
}

/// Lowers nodes in order.
pub fn lower_nodes(nodes: &[Node], lowering: &mut Lowering) {
    for node in nodes {
        let place = node.kind.lower(lowering, &node.inputs, node.len);
        lowering.finish_node(place, &node.inputs);
    }
}

/// Returns the operations of a network that does not denoise, its buffers, of which the first is the observation, and
/// the place of its output.
pub fn operations(graph: &Graph) -> (Vec<Step<Slice>>, Vec<Buffer>, Slice) {
    let mut lowering = Lowering::new(graph.own_len(), readers(graph));
    lower_nodes(&graph.nodes, &mut lowering);
    let output = lowering.place(graph.output());
    (lowering.steps, lowering.buffers, output)
}
