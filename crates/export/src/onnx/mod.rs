//! An ONNX model in double precision: values, bands, domain flag, and margins of the limits.

mod graph;
mod proto;

use coldplate_runtime::{Kernel, LimitKind, NINETY_FIVE, Surrogate, Transform};
use prost::Message;

use crate::content::{Basis, Content, Known, Polynomial, Scaling, Uncertainty};
use crate::{File, json};
use graph::{Builder, Elements, Value};
use proto::{Entry, Model, OperatorSet};

/// Version of the ONNX operators.
const OPSET: i64 = 17;
/// Oldest version of the ONNX format with these operators.
const FORMAT: i64 = 8;

pub(crate) fn write(surrogate: &Surrogate<'_>, content: &Content, name: &str) -> Vec<File> {
    let mut metadata = vec![Entry { key: "format".into(), value: "coldplate surrogate".into() }];
    metadata.extend(json::facts(surrogate).into_iter().map(|(key, value)| Entry { key: key.into(), value }));
    let model = Model {
        ir_version: FORMAT,
        opset_import: vec![OperatorSet { domain: String::new(), version: OPSET }],
        producer_name: "coldplate".into(),
        producer_version: env!("CARGO_PKG_VERSION").into(),
        graph: Some(Writer::default().graph(content, name)),
        metadata,
    };
    vec![File::new(format!("{name}.onnx"), model.encode_to_vec())]
}

#[derive(Default)]
struct Writer {
    graph: Builder,
}

impl Writer {
    fn graph(mut self, content: &Content, name: &str) -> proto::Graph {
        let (variables, points) = (content.variables.len(), content.points.len());
        let x = self.graph.input("conditions", variables, "one row per condition, one value per variable, in its unit");
        let scaled = self.scaled(&x, &content.scalings);
        let mut values = self.polynomials(&scaled, content);
        if !content.bases.is_empty() {
            let bases = self.bases(&scaled, content);
            values = self.graph.op("Add", &[&values, &bases]);
        }
        let half_widths: Vec<f64> = content.points.iter().map(|p| p.half_width).collect();
        let bands = match &content.uncertainty {
            Some(own) => {
                let slopes = self.slopes(&scaled, own, points);
                if let Some(known) = &own.known {
                    values = self.shifted(&values, slopes.as_ref(), own, known);
                }
                self.total_bands(&x, slopes.as_ref(), own, &half_widths)
            }
            None => {
                // Equal in every row.
                let widths = self.graph.row(&half_widths);
                let zeros = self.zeros_like(&values);
                self.graph.op("Add", &[&zeros, &widths])
            }
        };
        let inside = self.inside(&x, content);
        let numbers = Elements::Numbers;
        self.graph.output(&values, "values", &[points], numbers, "one per point, in its unit");
        self.graph.output(
            &bands,
            "bands",
            &[points],
            numbers,
            "half width of the interval that holds the value with a probability of 95 %",
        );
        self.graph.output(&inside, "inside", &[], Elements::Truths, "whether every variable lies in its fitted range");
        if !content.limits.is_empty() {
            let margins = self.margins(&x, &values, content);
            self.graph.output(
                &margins,
                "margins",
                &[content.limits.len()],
                numbers,
                "largest value allowed less the limited one, per limit",
            );
        }
        self.graph.finish(name)
    }

    /// A table with a column per scaling.
    fn scaled(&mut self, x: &Value, scalings: &[Scaling]) -> Value {
        let count = |own: Transform| scalings.iter().any(|s| s.transform == own);
        let variables = scalings.iter().map(|s| s.variable + 1).max().unwrap_or(0);
        let all: Vec<usize> = (0..variables).collect();
        let x = self.graph.columns(x, &all);
        let mut tables = vec![x.clone()];
        // First column of each transform.
        let mut starts = [0; 3];
        for (transform, operator) in [(Transform::Reciprocal, "Reciprocal"), (Transform::Log, "Log")] {
            if count(transform) {
                starts[transform as usize] = tables.len() * variables;
                let table = self.graph.op(operator, &[&x]);
                tables.push(table);
            }
        }
        let table = self.graph.beside(&tables);
        let places: Vec<usize> = scalings.iter().map(|s| starts[s.transform as usize] + s.variable).collect();
        let g = self.graph.columns(&table, &places);
        let [low, factor, offset] = [|s: &Scaling| s.low, |s: &Scaling| s.factor, |s: &Scaling| s.offset]
            .map(|of| self.graph.row(&scalings.iter().map(of).collect::<Vec<_>>()));
        let above = self.graph.op("Sub", &[&g, &low]);
        let wide = self.graph.op("Mul", &[&above, &factor]);
        self.graph.op("Add", &[&wide, &offset])
    }

    /// A table with a column per term; without terms, one column of ones.
    fn monomials(&mut self, scaled: &Value, scalings: &[usize], exponents: &[u8]) -> Value {
        let count = scalings.len();
        let constant = vec![0; count];
        let exponents = if exponents.is_empty() { &constant } else { exponents };
        let u = self.graph.columns(scaled, scalings);
        // Columns: u, one, u², u³, ...
        let mut tables = vec![self.graph.with_column(&u, 1.0)];
        let mut power = u.clone();
        for _ in 2..=exponents.iter().copied().max().unwrap_or(0) {
            power = self.graph.op("Mul", &[&power, &u]);
            tables.push(power.clone());
        }
        let table = self.graph.beside(&tables);
        let place = |v: usize, e: u8| match usize::from(e) {
            0 => count,
            1 => v,
            e => (e - 1) * count + 1 + v,
        };
        let factors: Vec<Value> = (0..count)
            .map(|v| {
                let places: Vec<usize> = exponents.chunks_exact(count).map(|term| place(v, term[v])).collect();
                self.graph.columns(&table, &places)
            })
            .collect();
        // The runtime's order of multiplication: the variables enter in pairs.
        let pairs: Vec<Value> = factors.chunks(2).map(|pair| self.product(pair)).collect();
        self.product(&pairs)
    }

    fn product(&mut self, factors: &[Value]) -> Value {
        let mut product = factors[0].clone();
        for factor in &factors[1..] {
            product = self.graph.op("Mul", &[&product, factor]);
        }
        product
    }

    fn polynomials(&mut self, scaled: &Value, content: &Content) -> Value {
        let tables: Vec<Value> = content.polynomials.iter().map(|own| self.polynomial(scaled, own)).collect();
        let points: Vec<usize> = content.polynomials.iter().flat_map(|own| own.points.iter().copied()).collect();
        self.in_order(&tables, &points, content.points.len())
    }

    fn polynomial(&mut self, scaled: &Value, own: &Polynomial) -> Value {
        let monomials = self.monomials(scaled, &own.scalings, &own.exponents);
        let zeros = vec![0.0; own.points.len()];
        let coefficients = if own.terms == 0 { &zeros } else { &own.coefficients };
        let table = self.graph.numbers(&[own.terms.max(1), own.points.len()], coefficients);
        self.graph.op("MatMul", &[&monomials, &table])
    }

    fn bases(&mut self, scaled: &Value, content: &Content) -> Value {
        let tables: Vec<Value> = content.bases.iter().map(|own| self.basis(scaled, own)).collect();
        let points: Vec<usize> = content.bases.iter().flat_map(|own| own.points.iter().copied()).collect();
        self.in_order(&tables, &points, content.points.len())
    }

    fn basis(&mut self, scaled: &Value, own: &Basis) -> Value {
        let variables = own.scalings.len();
        let mut square: Option<Value> = None;
        for (v, (scaling, scale)) in own.scalings.iter().zip(&own.scales).enumerate() {
            let u = self.graph.columns(scaled, &[*scaling]);
            let coordinates: Vec<f64> = own.centres.iter().skip(v).step_by(variables).copied().collect();
            let (coordinates, scale) = (self.graph.row(&coordinates), self.graph.number(*scale));
            let apart = self.graph.op("Sub", &[&u, &coordinates]);
            let apart = self.graph.op("Mul", &[&apart, &scale]);
            let own = self.graph.op("Mul", &[&apart, &apart]);
            square = Some(match square {
                Some(square) => self.graph.op("Add", &[&square, &own]),
                None => own,
            });
        }
        // There is at least one variable, and therefore a distance.
        let square = square.unwrap_or_else(|| scaled.clone());
        let values = match own.kernel {
            Kernel::ThinPlate => {
                let (tiny, half) = (self.graph.number(f64::MIN_POSITIVE), self.graph.number(0.5));
                let normal = self.graph.op("Max", &[&square, &tiny]);
                let (half, logarithm) = (self.graph.op("Mul", &[&half, &square]), self.graph.op("Log", &[&normal]));
                self.graph.op("Mul", &[&half, &logarithm])
            }
            Kernel::Cubic => {
                let root = self.graph.op("Sqrt", &[&square]);
                self.graph.op("Mul", &[&square, &root])
            }
            Kernel::Multiquadric => {
                let one = self.graph.number(1.0);
                let sum = self.graph.op("Add", &[&one, &square]);
                self.graph.op("Sqrt", &[&sum])
            }
            Kernel::Gaussian => {
                let negative = self.graph.op("Neg", &[&square]);
                self.graph.op("Exp", &[&negative])
            }
        };
        let weights = self.graph.numbers(&[own.count, own.points.len()], &own.weights);
        self.graph.op("MatMul", &[&values, &weights])
    }

    /// The columns of these tables, which belong to `points`, in the order of all points; zero for a point without a
    /// column.
    fn in_order(&mut self, tables: &[Value], points: &[usize], count: usize) -> Value {
        let mut table = self.graph.beside(tables);
        if points.len() < count {
            table = self.graph.with_column(&table, 0.0);
        }
        let places: Vec<usize> = (0..count).map(|point| points.iter().position(|p| *p == point).unwrap_or(points.len())).collect();
        self.graph.columns(&table, &places)
    }

    /// The slopes of every point along every parameter at each condition, (n, points, parameters); `None` without
    /// parameters.
    fn slopes(&mut self, scaled: &Value, own: &Uncertainty, points: usize) -> Option<Value> {
        if own.parameters == 0 {
            return None;
        }
        let monomials = self.monomials(scaled, &own.scalings, &own.exponents);
        // Rows: terms. Columns: points and parameters.
        let table: Vec<f64> = (0..own.terms)
            .flat_map(|t| {
                (0..points).flat_map(move |p| (0..own.parameters).map(move |k| own.slopes[(p * own.terms + t) * own.parameters + k]))
            })
            .collect();
        let table = self.graph.numbers(&[own.terms, points * own.parameters], &table);
        let all = self.graph.op("MatMul", &[&monomials, &table]);
        Some(self.graph.reshaped(&all, &[points, own.parameters]))
    }

    /// The slopes, (n, points, parameters), times a matrix, with rows of this shape. All points of all rows form one
    /// table for the product, because a product in three dimensions allows no empty batch.
    fn by_rows(&mut self, slopes: &Value, parameters: usize, matrix: &Value, shape: &[usize]) -> Value {
        let rows = self.graph.reshaped(slopes, &[parameters]);
        let product = self.graph.op("MatMul", &[&rows, matrix]);
        self.graph.reshaped(&product, shape)
    }

    /// The values plus the contribution of the mean of the states.
    fn shifted(&mut self, values: &Value, slopes: Option<&Value>, own: &Uncertainty, known: &Known) -> Value {
        let mut shifted = values.clone();
        if let Some(slopes) = slopes {
            let mean = self.graph.numbers(&[own.parameters, 1], &known.mean[..own.parameters]);
            let added = self.by_rows(slopes, own.parameters, &mean, &[own.own.len()]);
            shifted = self.graph.op("Add", &[&shifted, &added]);
        }
        let constant = self.graph.row(&own.missed_means(known));
        self.graph.op("Add", &[&shifted, &constant])
    }

    /// Half widths of the bands from all uncertainties.
    fn total_bands(&mut self, x: &Value, slopes: Option<&Value>, own: &Uncertainty, half_widths: &[f64]) -> Value {
        let points = half_widths.len();
        let spread = own.spread();
        let fit = half_widths.iter().map(|half| (half / NINETY_FIVE) * (half / NINETY_FIVE));
        let constant: Vec<f64> = fit.zip(&spread.missed).map(|(fit, missed)| fit + missed).collect();
        let constant = self.graph.row(&constant);
        let growth = self.growth(x, own);
        let missed: Vec<f64> = own.own.iter().zip(&own.common).map(|(own, common)| own * own + common * common).collect();
        let missed = self.graph.row(&missed);
        let grown = self.graph.op("Mul", &[&growth, &missed]);
        let mut variance = self.graph.op("Add", &[&grown, &constant]);
        if let Some(slopes) = slopes {
            let mut towards = slopes.clone();
            if let Some(covariance) = &spread.covariance {
                let covariance = self.graph.numbers(&[own.parameters, own.parameters], covariance);
                let cross: Vec<f64> = spread.cross.iter().map(|cross| 2.0 * cross).collect();
                let cross = self.graph.numbers(&[1, points, own.parameters], &cross);
                let product = self.by_rows(slopes, own.parameters, &covariance, &[points, own.parameters]);
                towards = self.graph.op("Add", &[&product, &cross]);
            }
            let squares = self.graph.op("Mul", &[slopes, &towards]);
            let last = self.graph.integers(&[2]);
            let sum = self.graph.op_with("ReduceSum", &[&squares, &last], &[("keepdims", 0)]);
            variance = self.graph.op("Add", &[&variance, &sum]);
        }
        // Rounding must not leave a negative variance.
        let (zero, factor) = (self.graph.number(0.0), self.graph.number(NINETY_FIVE));
        let variance = self.graph.op("Max", &[&variance, &zero]);
        let deviation = self.graph.op("Sqrt", &[&variance]);
        self.graph.op("Mul", &[&deviation, &factor])
    }

    /// Relative variance added by the distance from the measured conditions, (n, 1).
    fn growth(&mut self, x: &Value, own: &Uncertainty) -> Value {
        let divisors: Vec<f64> = own.halves.iter().map(|half| if *half > 0.0 { *half } else { 1.0 }).collect();
        let counted: Vec<f64> = own.halves.iter().map(|half| f64::from(u8::from(*half > 0.0))).collect();
        let [centre, divisors, counted] = [&own.centre, &divisors, &counted].map(|row| self.graph.row(row));
        let away = self.graph.op("Sub", &[x, &centre]);
        let away = self.graph.op("Div", &[&away, &divisors]);
        let away = self.graph.op("Mul", &[&away, &counted]);
        let squares = self.graph.op("Mul", &[&away, &away]);
        let columns = self.graph.integers(&[1]);
        let sum = self.graph.op_with("ReduceSum", &[&squares, &columns], &[("keepdims", 1)]);
        let share = self.graph.number(own.growth * own.growth);
        self.graph.op("Mul", &[&sum, &share])
    }

    fn inside(&mut self, x: &Value, content: &Content) -> Value {
        let low: Vec<f64> = content.variables.iter().map(|v| v.low).collect();
        let high: Vec<f64> = content.variables.iter().map(|v| v.high).collect();
        let (low, high) = (self.graph.row(&low), self.graph.row(&high));
        let above = self.graph.op("GreaterOrEqual", &[x, &low]);
        let below = self.graph.op("LessOrEqual", &[x, &high]);
        let within = self.graph.op("And", &[&above, &below]);
        let mut all: Option<Value> = None;
        for v in 0..content.variables.len() {
            let place = self.graph.integers(&[v as i64]);
            let column = self.graph.op_with("Gather", &[&within, &place], &[("axis", 1)]);
            all = Some(match all {
                Some(all) => self.graph.op("And", &[&all, &column]),
                None => column,
            });
        }
        let (all, columns) = (all.unwrap_or(within), self.graph.integers(&[1]));
        self.graph.op("Squeeze", &[&all, &columns])
    }

    fn margins(&mut self, x: &Value, values: &Value, content: &Content) -> Value {
        let limited: Vec<Value> = content
            .limits
            .iter()
            .map(|limit| match &limit.kind {
                LimitKind::Maximum { point } => self.graph.columns(values, &[*point]),
                LimitKind::Rise { point, variable } => {
                    let (value, over) = (self.graph.columns(values, &[*point]), self.graph.columns(x, &[*variable]));
                    self.graph.op("Sub", &[&value, &over])
                }
                LimitKind::Difference { first, second } => {
                    let (first, second) = (self.graph.columns(values, &[*first]), self.graph.columns(values, &[*second]));
                    self.graph.op("Sub", &[&first, &second])
                }
                LimitKind::Spread(points) => {
                    let columns: Vec<Value> = points.iter().map(|point| self.graph.columns(values, &[*point])).collect();
                    let columns: Vec<&Value> = columns.iter().collect();
                    let (most, least) = (self.graph.op("Max", &columns), self.graph.op("Min", &columns));
                    self.graph.op("Sub", &[&most, &least])
                }
            })
            .collect();
        let limited = self.graph.beside(&limited);
        let maxima: Vec<f64> = content.limits.iter().map(|limit| limit.maximum).collect();
        let maxima = self.graph.row(&maxima);
        self.graph.op("Sub", &[&maxima, &limited])
    }

    fn zeros_like(&mut self, table: &Value) -> Value {
        let shape = self.graph.op("Shape", &[table]);
        let zero = self.graph.number(0.0);
        self.graph.op("Expand", &[&zero, &shape])
    }
}
