//! Counts what a file holds before it is decoded.
//!
//! An empty entry of a list takes two bytes in a file and up to two hundred in memory, so a file of
//! some megabytes could ask for gigabytes. This walk allocates nothing. It may count more than the
//! decoder would take (what stands in a damaged or unknown part), never less, and leaves it to the
//! decoder to say what is wrong with the bytes.

use crate::messages::{Entries, MODEL, NODE, TENSOR};

use super::{MAX_NODES, ReadError, invalid, too_many_nodes};

/// Most names, numbers of attributes, axes, inputs and outputs of a file together: 64 for each of
/// [`MAX_NODES`] nodes. The largest network of the project has a few hundred.
pub(super) const MAX_ENTRIES: usize = 1 << 18;

/// Wire types of protobuf.
const VARINT: u64 = 0;
const EIGHT_BYTES: u64 = 1;
const LENGTH_DELIMITED: u64 = 2;
const START_GROUP: u64 = 3;
const END_GROUP: u64 = 4;
const FOUR_BYTES: u64 = 5;

/// What was counted so far.
#[derive(Debug, Default)]
struct Count {
    nodes: usize,
    initializers: usize,
    others: usize,
}

/// Refuses a file with more entries than a network has.
pub(super) fn check(onnx_bytes: &[u8]) -> Result<(), ReadError> {
    Count::default().message(onnx_bytes, MODEL)
}

impl Count {
    /// Counts the lists of a message by its `fields`. A group, which ONNX does not have, is walked as
    /// if what it holds stood in the message.
    fn message(&mut self, bytes: &[u8], fields: &[(u64, Entries)]) -> Result<(), ReadError> {
        let mut rest = bytes;
        while let Some(key) = varint(&mut rest) {
            let (number, wire_type) = (key >> 3, key & 7);
            let Some(value) = value(&mut rest, wire_type) else {
                break;
            };
            let field = fields.iter().find(|(known, _)| *known == number);
            let Some((_, entries)) = field else {
                continue;
            };
            match entries {
                Entries::Integers if wire_type == VARINT => self.others += 1,
                // Each takes a byte or more.
                Entries::Integers => self.others += value.len(),
                Entries::Message(fields) => self.message(value, fields)?,
                Entries::Node => {
                    self.nodes += 1;
                    self.message(value, NODE)?;
                }
                Entries::Initializer => {
                    self.initializers += 1;
                    self.message(value, TENSOR)?;
                }
                Entries::Listed(fields) => {
                    self.others += 1;
                    self.message(value, fields)?;
                }
                Entries::Name => self.others += 1,
            }
            self.within_limits()?;
        }
        Ok(())
    }

    fn within_limits(&self) -> Result<(), ReadError> {
        if self.nodes > MAX_NODES || self.initializers > MAX_NODES {
            return Err(too_many_nodes());
        }
        if self.others > MAX_ENTRIES {
            let problem =
                format!("more than {MAX_ENTRIES} names, attributes, axes, inputs and outputs");
            return Err(invalid("graph", problem));
        }
        Ok(())
    }
}

/// Takes a number off the front of `rest`; none where there is none whole.
fn varint(rest: &mut &[u8]) -> Option<u64> {
    let mut number = 0_u64;
    for shift in (0..64).step_by(7) {
        let (&byte, after) = rest.split_first()?;
        *rest = after;
        // The last of ten bytes has room for one bit.
        if shift == 63 && byte > 1 {
            return None;
        }
        number |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(number);
        }
    }
    None
}

/// Takes the bytes of a field's value off the front of `rest`, without its length.
fn value<'a>(rest: &mut &'a [u8], wire_type: u64) -> Option<&'a [u8]> {
    let length = match wire_type {
        VARINT => {
            varint(rest)?;
            0
        }
        EIGHT_BYTES => 8,
        FOUR_BYTES => 4,
        LENGTH_DELIMITED => usize::try_from(varint(rest)?).ok()?,
        START_GROUP | END_GROUP => 0,
        _ => return None,
    };
    let (value, after) = rest.split_at_checked(length)?;
    *rest = after;
    Some(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{
        Attribute, Dimension, GraphMessage, Length, Model, NodeMessage, OperatorSet, TensorMessage,
        TensorShape, TensorType, TypeMessage, ValueInfo,
    };

    /// A file whose lists have 2, 3, 5, ... entries.
    fn model() -> Model {
        let node = NodeMessage {
            input: vec!["x".to_owned(); 2],
            output: vec!["y".to_owned(); 3],
            attribute: vec![
                Attribute {
                    ints: vec![1; 7],
                    ..Default::default()
                };
                5
            ],
            ..Default::default()
        };
        let tensor = TensorMessage {
            dims: vec![1; 11],
            raw_data: vec![0; 100],
            ..Default::default()
        };
        let shape = TensorShape {
            dim: vec![
                Dimension {
                    value: Some(Length::Fixed(1)),
                };
                13
            ],
        };
        let port = ValueInfo {
            name: "port".to_owned(),
            r#type: Some(TypeMessage {
                tensor_type: Some(TensorType {
                    elem_type: 1,
                    shape: Some(shape),
                }),
            }),
        };
        Model {
            graph: Some(GraphMessage {
                node: vec![node; 2],
                initializer: vec![tensor; 3],
                input: vec![port.clone(); 5],
                output: vec![port; 7],
                ..Default::default()
            }),
            opset_import: vec![OperatorSet::default(); 17],
            ..Default::default()
        }
    }

    fn count(bytes: &[u8]) -> (usize, usize, usize) {
        let mut count = Count::default();
        count.message(bytes, MODEL).expect("a small file");
        (count.nodes, count.initializers, count.others)
    }

    #[test]
    fn every_list_of_the_messages_is_counted() {
        let per_node = 2 + 3 + 5 + 5 * 7;
        let ports = (5 + 7) * (1 + 13);
        let others = 2 * per_node + 3 * 11 + ports + 17;
        assert_eq!(count(&model().to_bytes()), (2, 3, others));
    }

    #[test]
    fn numbers_that_are_not_packed_are_counted_too() {
        // Graph, node, attribute with the field 8 as three single numbers.
        let ints = [0x40, 1, 0x40, 1, 0x40, 1];
        let bytes = [&[0x3a, 10, 0x0a, 8, 0x2a, 6][..], &ints].concat();
        assert_eq!(count(&bytes), (1, 0, 1 + 3));
        let model = Model::from_bytes(&bytes).expect("a file");
        assert_eq!(
            model.graph.expect("a graph").node[0].attribute[0].ints,
            [1; 3]
        );
    }

    #[test]
    fn what_stands_behind_damage_in_an_unknown_part_is_counted() {
        // A group of field 100 that holds what would be a damaged graph, then a node.
        let group = [0xa3, 0x06, 0x3a, 1, 0x0a, 0xa4, 0x06];
        let bytes = [&group[..], &[0x3a, 2, 0x0a, 0]].concat();
        let model = Model::from_bytes(&bytes).expect("a file");
        assert_eq!(model.graph.expect("a graph").node.len(), 1);
        assert_eq!(count(&bytes), (1, 0, 0));
    }

    #[test]
    fn numbers_are_read_as_protobuf_has_them() {
        for (bytes, number) in [
            (&[0x05][..], Some(5)),
            (&[0xac, 0x02], Some(300)),
            (&[0xff; 9], None),
            (&[], None),
        ] {
            assert_eq!(varint(&mut &*bytes), number, "{bytes:?}");
        }
        let mut largest = [0xff; 10];
        largest[9] = 1;
        assert_eq!(varint(&mut &largest[..]), Some(u64::MAX));
        largest[9] = 2;
        assert_eq!(varint(&mut &largest[..]), None);
    }
}
