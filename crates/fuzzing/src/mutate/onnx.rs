//! Mutations of ONNX graphs, message by message: the encoder makes lengths and numbers right.

use dynaskin_onnx::messages::{
    Dimension, FLOAT, FLOAT16, GraphMessage, INT64, Length, Model, NodeMessage, TensorMessage,
    ValueInfo,
};

use super::{BROKEN, Mutator};

/// Operators that are read, and some that are not.
const OPERATORS: [&str; 20] = [
    "Add",
    "Sub",
    "Mul",
    "Div",
    "MatMul",
    "Gemm",
    "Sigmoid",
    "Tanh",
    "Relu",
    "Exp",
    "Log",
    "Split",
    "Concat",
    "Gather",
    "Reshape",
    "Transpose",
    "Cast",
    "Conv",
    "ConvTranspose",
    "LSTM",
];

/// Names that the contract knows.
const NAMES: [&str; 8] = [
    "features",
    "latent",
    "offsets",
    "state_h",
    "state_h_out",
    "state_",
    "state_c_out",
    "",
];

impl Mutator<'_> {
    /// A network.
    pub fn onnx(&mut self, file: &[u8]) -> Vec<u8> {
        let model = Model::from_bytes(file).ok().filter(|m| m.graph.is_some());
        let Some(mut model) = model.filter(|_| !self.one_in(BROKEN)) else {
            return self.broken(file);
        };
        if self.one_in(40) {
            if let Some(set) = model.opset_import.first_mut() {
                set.version = self.integer();
            }
            return model.to_bytes();
        }
        if let Some(graph) = &mut model.graph {
            self.graph(graph);
        }
        model.to_bytes()
    }

    fn graph(&mut self, graph: &mut GraphMessage) {
        match self.below(8) {
            0 => self.ports(&mut graph.input),
            1 => self.ports(&mut graph.output),
            2..=4 if !graph.initializer.is_empty() => {
                let at = self.below(graph.initializer.len());
                match self.below(12) {
                    0 => {
                        graph.initializer.remove(at);
                    }
                    1 => graph.initializer.push(graph.initializer[at].clone()),
                    _ => self.tensor(&mut graph.initializer[at]),
                }
            }
            _ if !graph.node.is_empty() => self.nodes(&mut graph.node),
            _ => {}
        }
    }

    fn ports(&mut self, ports: &mut Vec<ValueInfo>) {
        if ports.is_empty() {
            return;
        }
        let at = self.below(ports.len());
        match self.below(6) {
            0 => {
                ports.remove(at);
            }
            1 => ports.push(ports[at].clone()),
            2 => ports[at].name = NAMES[self.below(NAMES.len())].to_owned(),
            _ => {
                let tensor = ports[at]
                    .r#type
                    .as_mut()
                    .and_then(|t| t.tensor_type.as_mut());
                let Some(tensor) = tensor else { return };
                if self.one_in(6) {
                    tensor.elem_type = [FLOAT, FLOAT16, INT64, 0, 99][self.below(5)];
                }
                let Some(shape) = &mut tensor.shape else {
                    return;
                };
                if shape.dim.is_empty() || self.one_in(4) {
                    let value = Some(Length::Fixed(self.length()));
                    return shape.dim.push(Dimension { value });
                }
                let axis = self.below(shape.dim.len());
                shape.dim[axis].value = match self.below(6) {
                    0 => None,
                    1 => Some(Length::Named("N".to_owned())),
                    _ => Some(Length::Fixed(self.length())),
                };
            }
        }
    }

    /// A length of an axis, mostly one that a small network has.
    fn length(&mut self) -> i64 {
        match self.one_in(3) {
            true => self.integer(),
            false => self.below(9) as i64,
        }
    }

    fn tensor(&mut self, tensor: &mut TensorMessage) {
        match self.below(8) {
            0 => tensor.data_type = [FLOAT, FLOAT16, INT64, 0, 99][self.below(5)],
            1 if !tensor.dims.is_empty() => {
                let axis = self.below(tensor.dims.len());
                tensor.dims[axis] = self.length();
            }
            2 => {
                let length = self.length();
                tensor.dims.push(length);
            }
            3 if tensor.dims.len() > 1 => tensor.dims.reverse(),
            4 => {
                let value = self.float() as f32;
                tensor.float_data.push(value);
            }
            5 => {
                let value = self.integer();
                tensor.int64_data.push(value);
            }
            _ => self.data(&mut tensor.raw_data),
        }
    }

    fn nodes(&mut self, nodes: &mut Vec<NodeMessage>) {
        let (at, other) = (self.below(nodes.len()), self.below(nodes.len()));
        match self.below(10) {
            0 => {
                nodes.remove(at);
            }
            1 => nodes.insert(other, nodes[at].clone()),
            2 => nodes.swap(at, other),
            3 => nodes[at].op_type = OPERATORS[self.below(OPERATORS.len())].to_owned(),
            4..=6 => {
                // An input from elsewhere in the graph.
                let names: Vec<String> = nodes
                    .iter()
                    .flat_map(|node| node.input.iter().chain(&node.output))
                    .cloned()
                    .collect();
                if names.is_empty() {
                    return;
                }
                let name = names[self.below(names.len())].clone();
                let inputs = &mut nodes[at].input;
                match self.below(4) {
                    0 => inputs.push(name),
                    1 => {
                        inputs.pop();
                    }
                    _ if !inputs.is_empty() => {
                        let place = self.below(inputs.len());
                        inputs[place] = name;
                    }
                    _ => {}
                }
            }
            7 => {
                let output = nodes[other].output.clone();
                nodes[at].output = output;
            }
            _ => self.attribute(&mut nodes[at]),
        }
    }

    fn attribute(&mut self, node: &mut NodeMessage) {
        if node.attribute.is_empty() {
            return;
        }
        let at = self.below(node.attribute.len());
        let small = [-3, -2, -1, 0, 1, 2, 3, 4];
        let number = match self.one_in(4) {
            true => self.integer(),
            false => small[self.below(small.len())],
        };
        let kind = self.below(4);
        let attribute = &mut node.attribute[at];
        match kind {
            0 => {
                node.attribute.remove(at);
            }
            1 => attribute.ints.push(number),
            2 if !attribute.ints.is_empty() => {
                let last = attribute.ints.len() - 1;
                attribute.ints[last] = number;
            }
            _ => attribute.i = number,
        }
    }
}
