//! Building a graph, one operation after the other.

use super::proto::{ATTRIBUTE_INT, Attribute, BOOL, DOUBLE, Dimension, Graph, INT64, Node, Shape, Tensor, TensorType, Type, ValueInfo};

/// A value in the graph, by its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Value(String);

/// Type of the elements of an output.
#[derive(Debug, Clone, Copy)]
pub(super) enum Elements {
    Numbers,
    Truths,
}

#[derive(Default)]
pub(super) struct Builder {
    graph: Graph,
}

impl Builder {
    pub(super) fn finish(mut self, name: &str) -> Graph {
        name.clone_into(&mut self.graph.name);
        self.graph
    }

    /// An input of numbers with any number of rows.
    pub(super) fn input(&mut self, name: &str, columns: usize, description: &str) -> Value {
        self.graph.inputs.push(information(name, &[columns], Elements::Numbers, description));
        Value(name.into())
    }

    /// Makes a value an output under a name; `columns` is empty for one entry per row.
    pub(super) fn output(&mut self, value: &Value, name: &str, columns: &[usize], elements: Elements, description: &str) {
        self.node("Identity", std::slice::from_ref(value), name.into(), &[]);
        self.graph.outputs.push(information(name, columns, elements, description));
    }

    /// A constant of this shape.
    pub(super) fn numbers(&mut self, shape: &[usize], values: &[f64]) -> Value {
        self.tensor(DOUBLE, shape, values.iter().flat_map(|value| value.to_le_bytes()).collect())
    }

    /// A constant row.
    pub(super) fn row(&mut self, values: &[f64]) -> Value {
        self.numbers(&[1, values.len()], values)
    }

    /// A constant number.
    pub(super) fn number(&mut self, value: f64) -> Value {
        self.numbers(&[], &[value])
    }

    /// A constant list of indices or lengths.
    pub(super) fn integers(&mut self, values: &[i64]) -> Value {
        self.tensor(INT64, &[values.len()], values.iter().flat_map(|value| value.to_le_bytes()).collect())
    }

    /// The result of an operation.
    pub(super) fn op(&mut self, operator: &str, inputs: &[&Value]) -> Value {
        self.op_with(operator, inputs, &[])
    }

    /// The result of an operation with attributes.
    pub(super) fn op_with(&mut self, operator: &str, inputs: &[&Value], attributes: &[(&str, i64)]) -> Value {
        let name = format!("{}_{}", operator.to_lowercase(), self.graph.nodes.len());
        let inputs: Vec<Value> = inputs.iter().map(|&value| value.clone()).collect();
        self.node(operator, &inputs, name.clone(), attributes);
        Value(name)
    }

    /// Columns of a table, by index.
    pub(super) fn columns(&mut self, table: &Value, places: &[usize]) -> Value {
        let places: Vec<i64> = places.iter().map(|place| *place as i64).collect();
        let places = self.integers(&places);
        self.op_with("Gather", &[table, &places], &[("axis", 1)])
    }

    /// The numbers of a table with rows of another shape.
    pub(super) fn reshaped(&mut self, table: &Value, row: &[usize]) -> Value {
        let shape: Vec<i64> = std::iter::once(-1).chain(row.iter().map(|length| *length as i64)).collect();
        let shape = self.integers(&shape);
        self.op("Reshape", &[table, &shape])
    }

    /// Tables side by side.
    pub(super) fn beside(&mut self, tables: &[Value]) -> Value {
        match tables {
            [only] => only.clone(),
            _ => self.op_with("Concat", &tables.iter().collect::<Vec<_>>(), &[("axis", 1)]),
        }
    }

    /// The table with one more column that repeats this number.
    pub(super) fn with_column(&mut self, table: &Value, value: f64) -> Value {
        let (pads, value) = (self.integers(&[0, 0, 0, 1]), self.number(value));
        self.op("Pad", &[table, &pads, &value])
    }

    fn tensor(&mut self, elements: i32, shape: &[usize], bytes: Vec<u8>) -> Value {
        let shape: Vec<i64> = shape.iter().map(|length| *length as i64).collect();
        // An equal constant that exists already is used again.
        if let Some(own) = self.graph.initializers.iter().find(|own| own.elements == elements && own.shape == shape && own.bytes == bytes) {
            return Value(own.name.clone());
        }
        let name = format!("constant_{}", self.graph.initializers.len());
        self.graph.initializers.push(Tensor { shape, elements, name: name.clone(), bytes });
        Value(name)
    }

    fn node(&mut self, operator: &str, inputs: &[Value], output: String, attributes: &[(&str, i64)]) {
        self.graph.nodes.push(Node {
            inputs: inputs.iter().map(|value| value.0.clone()).collect(),
            name: output.clone(),
            outputs: vec![output],
            operator: operator.into(),
            attributes: attributes.iter().map(|(name, int)| Attribute { name: (*name).into(), int: *int, kind: ATTRIBUTE_INT }).collect(),
        });
    }
}

fn information(name: &str, columns: &[usize], elements: Elements, description: &str) -> ValueInfo {
    let rows = Dimension { length: None, name: Some("n".into()) };
    let columns = columns.iter().map(|columns| Dimension { length: Some(*columns as i64), name: None });
    let elements = match elements {
        Elements::Numbers => DOUBLE,
        Elements::Truths => BOOL,
    };
    let tensor = TensorType { elements, shape: Some(Shape { dimensions: std::iter::once(rows).chain(columns).collect() }) };
    ValueInfo { name: name.into(), kind: Some(Type { tensor: Some(tensor) }), description: description.into() }
}
