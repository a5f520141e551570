//! The trained network as ONNX files of the project's contract (ARCHITECTURE.md, "ONNX").

use burn::tensor::Tensor;
use dynaskin_onnx::{Graph, LstmWeights, Precision, Value, WriteError};

use super::blocks::BlockBasis;
use super::inputs::PredictorInputs;
use super::predictor::{Predictor, PredictorSizes};
use super::spin::Spin;
use crate::TrainError;

/// `predictor.onnx`: `features` [1,F] and the states `state_q`, `state_v` [1,springs] and
/// `state_h`, `state_c` [1,hidden] in; `latent` [1,L] (metres) and `state_*_out` out. One call is
/// one tick of the equations at the head of the `predictor` module. Scaling of features and
/// latents is folded into the weights; the motion's origin is subtracted first, in single
/// precision, so that rest is exactly zero. Matrices are stored in `precision`.
///
/// # Errors
/// [`TrainError::Onnx`], such as for weights that are not finite.
pub fn predictor_onnx(
    predictor: &Predictor,
    inputs: &PredictorInputs,
    deviation_m: &[f32],
    precision: Precision,
) -> Result<Vec<u8>, TrainError> {
    let normaliser = &inputs.normaliser;
    let weights = Folded::new(predictor, inputs, deviation_m, precision);
    let sizes = weights.sizes;
    let mut graph = Graph::new("predictor");
    let motion_count = normaliser.motion;
    let kind_conditions = normaliser.origin.len() - motion_count;
    let features = graph.input("features", &[1, normaliser.origin.len()])?;
    let parts = graph.split(&features, 1, &[motion_count, kind_conditions])?;
    let origin = &normaliser.origin[..motion_count];
    let origin = graph.weights("origin", &[motion_count], origin, Precision::Single)?;
    let centred = graph.sub(&parts[0], &origin)?;
    let [first, second] = Spin::factors();
    let first = graph.gather(&parts[0], 1, &first)?;
    let second = graph.gather(&parts[0], 1, &second)?;
    let spin = graph.mul(&first, &second)?;
    let motion = &graph.concat(&[&centred, &spin], 1)?;
    let condition = &inputs.build.write(&mut graph, &parts[1])?;
    let encoder = weights.matrix(&mut graph, "encoder", &weights.encoder, sizes.motion)?;
    let encoding = graph.matmul(motion, &encoder)?;
    let encoding = graph.tanh(&encoding);

    let (modes, spring_states) = springs(&mut graph, &weights, motion, condition, &encoding)?;
    let code_rows = 2 * sizes.springs + sizes.encoding;
    let code = weights.matrix(&mut graph, "code", &weights.code, code_rows)?;
    let code_input = graph.concat(&[&modes, &encoding], 1)?;
    let code = graph.matmul(&code_input, &code)?;
    let code = graph.tanh(&code);
    let (output, lstm_states) = lstm(&mut graph, &weights, condition, &code)?;

    let rows = 2 * sizes.springs + sizes.hidden + 2 * sizes.encoding;
    let readout = weights.matrix(&mut graph, "readout", &weights.readout, rows)?;
    let read = graph.concat(&[&modes, &output, &encoding, &code], 1)?;
    let latent = graph.matmul(&read, &readout)?;
    graph.output("latent", &latent)?;
    for (name, state) in spring_states.into_iter().chain(lstm_states) {
        graph.output(&format!("state_{name}_out"), &state)?;
    }
    Ok(graph.into_bytes())
}

/// States that leave the graph, by the letter of their name.
type States = [(&'static str, Value); 2];

/// One tick of the springs: the scaled modes, and q and v.
fn springs(
    graph: &mut Graph,
    weights: &Folded,
    motion: &Value,
    condition: &Value,
    encoding: &Value,
) -> Result<(Value, States), WriteError> {
    let PredictorSizes {
        motion: motion_count,
        conditions,
        encoding: encoding_count,
        springs,
        ..
    } = weights.sizes;
    let position = graph.input("state_q", &[1, springs])?;
    let velocity = graph.input("state_v", &[1, springs])?;
    let drive_rows = motion_count + encoding_count;
    let drive = weights.matrix(graph, "drive", &weights.drive, drive_rows)?;
    let pole_rows = conditions + encoding_count;
    let poles = weights.matrix(graph, "poles", &weights.poles, pole_rows)?;
    let poles_bias = weights.vector(graph, "poles_bias", &weights.poles_bias)?;
    let mode_scale = weights.matrix(graph, "mode_scale", &weights.mode_scale, conditions)?;

    let pole_input = graph.concat(&[condition, encoding], 1)?;
    let poles = graph.dense(&pole_input, &poles, &poles_bias)?;
    let poles = graph.sigmoid(&poles);
    let parts = graph.split(&poles, 1, &[springs, springs])?;
    let stiffness = graph.add(&parts[0], &parts[0])?;
    let retained = &parts[1];
    let drive_input = graph.concat(&[motion, encoding], 1)?;
    let target = graph.matmul(&drive_input, &drive)?;
    let stretch = graph.sub(&target, &position)?;
    let pull = graph.mul(&stiffness, &stretch)?;
    let kept = graph.mul(retained, &velocity)?;
    let velocity = graph.add(&kept, &pull)?;
    let position = graph.add(&position, &velocity)?;
    let scale = graph.matmul(condition, &mode_scale)?;
    let scale = graph.exp(&scale);
    let modes = graph.concat(&[&position, &velocity], 1)?;
    let modes = graph.mul(&modes, &scale)?;
    Ok((modes, [("q", position), ("v", velocity)]))
}

/// One tick of the LSTM: its output, and h and cells.
fn lstm(
    graph: &mut Graph,
    weights: &Folded,
    condition: &Value,
    code: &Value,
) -> Result<(Value, States), WriteError> {
    let PredictorSizes {
        conditions,
        encoding: encoding_count,
        hidden,
        ..
    } = weights.sizes;
    let state_h = graph.input("state_h", &[1, hidden])?;
    let state_c = graph.input("state_c", &[1, hidden])?;
    let input_rows = encoding_count + conditions;
    let from_input = weights.matrix(graph, "from_input", &weights.from_input, input_rows)?;
    let from_hidden = weights.matrix(graph, "from_hidden", &weights.from_hidden, hidden)?;
    let bias = weights.vector(graph, "bias", &weights.bias)?;

    let cell_input = graph.concat(&[code, condition], 1)?;
    let cell = LstmWeights {
        from_input: &from_input,
        from_hidden: &from_hidden,
        bias: &bias,
    };
    let (hidden, cells) = graph.lstm_cell(&cell_input, &state_h, &state_c, cell)?;
    Ok((hidden.clone(), [("h", hidden), ("c", cells)]))
}

/// `decoder.onnx`: `latent` [1,L] in metres to `offsets` [1,V,3] in metres: for each block the
/// product of its latents with its basis, then the vertices put into the order of the data set.
/// Weights are stored in `precision`.
///
/// # Errors
/// [`TrainError::Onnx`].
pub fn decoder_onnx(basis: &BlockBasis, precision: Precision) -> Result<Vec<u8>, TrainError> {
    let (components, coordinates) = (basis.components(), basis.coordinates());
    let mut graph = Graph::new("decoder");
    let latent = graph.input("latent", &[1, components])?;
    let counts = basis.blocks.iter().map(|block| block.basis.components());
    let latents = graph.split(&latent, 1, &counts.collect::<Vec<_>>())?;
    let mut parts = Vec::new();
    for (block, latent) in basis.blocks.iter().zip(&latents) {
        let shape = [block.basis.components(), block.basis.coordinates()];
        let name = format!("basis {}", block.name);
        let rows = graph.weights(&name, &shape, &block.basis.rows(), precision)?;
        parts.push(graph.matmul(latent, &rows)?);
    }
    let flat = graph.concat(&parts.iter().collect::<Vec<_>>(), 1)?;
    let in_blocks = graph.reshape(&flat, &[1, coordinates / 3, 3])?;
    let offsets = graph.gather(&in_blocks, 1, &basis.places())?;
    graph.output("offsets", &offsets)?;
    Ok(graph.into_bytes())
}

/// The predictor's weights, row-major, with the scaling of features and latents folded in.
struct Folded {
    sizes: PredictorSizes,
    encoder: Vec<f32>,
    drive: Vec<f32>,
    /// The damping half is negated: what is retained, 1 - σ(x), is σ(-x).
    poles: Vec<f32>,
    poles_bias: Vec<f32>,
    mode_scale: Vec<f32>,
    code: Vec<f32>,
    /// Input weights of the whole LSTM cell: code, then the conditions, which have zeros for the candidate.
    from_input: Vec<f32>,
    bias: Vec<f32>,
    /// Zeros for the candidate, as in `bias`.
    from_hidden: Vec<f32>,
    readout: Vec<f32>,
    /// Of the matrices.
    precision: Precision,
}

impl Folded {
    fn new(
        predictor: &Predictor,
        inputs: &PredictorInputs,
        deviation_m: &[f32],
        precision: Precision,
    ) -> Self {
        let sizes = predictor.sizes();
        let normaliser = &inputs.normaliser;
        let motion_scale = &normaliser.scale[..normaliser.motion];
        let motion_scale = &[motion_scale, &inputs.spin.scale].concat();
        let condition_scale = &inputs.build.scale;
        let hidden = sizes.hidden;
        let mut poles = scaled_rows(&predictor.local_poles(), condition_scale);
        let mut poles_bias = flat(predictor.tied_poles_bias());
        for row in poles.chunks_exact_mut(2 * sizes.springs) {
            row[sizes.springs..].iter_mut().for_each(|w| *w = -*w);
        }
        poles_bias[sizes.springs..]
            .iter_mut()
            .for_each(|w| *w = -*w);
        let mut from_input = flat(predictor.local_from_code());
        for row in
            scaled_rows(&predictor.local_from_condition(), condition_scale).chunks_exact(3 * hidden)
        {
            from_input.extend_from_slice(row);
            from_input.extend(std::iter::repeat_n(0.0, hidden));
        }
        let mut from_hidden = Vec::with_capacity(4 * hidden * hidden);
        for row in flat(predictor.local_from_hidden()).chunks_exact(3 * hidden) {
            from_hidden.extend_from_slice(row);
            from_hidden.extend(std::iter::repeat_n(0.0, hidden));
        }
        let mut bias = flat(predictor.tied_bias());
        bias.extend(std::iter::repeat_n(0.0, hidden));
        let mut readout = flat(predictor.local_readout());
        for row in readout.chunks_exact_mut(sizes.latent) {
            for (weight, deviation) in row.iter_mut().zip(deviation_m) {
                *weight *= deviation;
            }
        }
        Self {
            encoder: scaled_rows(&predictor.local_encoder(), motion_scale),
            drive: scaled_rows(&predictor.local_drive(), motion_scale),
            poles,
            poles_bias,
            mode_scale: scaled_rows(&predictor.local_mode_scale(), condition_scale),
            code: flat(predictor.local_code()),
            from_input,
            bias,
            from_hidden,
            readout,
            sizes,
            precision,
        }
    }

    fn matrix(
        &self,
        graph: &mut Graph,
        name: &str,
        numbers: &[f32],
        rows: usize,
    ) -> Result<Value, WriteError> {
        let shape = [rows, numbers.len() / rows];
        graph.weights(name, &shape, numbers, self.precision)
    }

    fn vector(&self, graph: &mut Graph, name: &str, numbers: &[f32]) -> Result<Value, WriteError> {
        graph.weights(name, &[numbers.len()], numbers, Precision::Single)
    }
}

/// A matrix, row-major, its first rows multiplied with `scale`.
fn scaled_rows(matrix: &Tensor<2>, scale: &[f32]) -> Vec<f32> {
    let [_, columns] = matrix.dims();
    let mut numbers = flat(matrix.clone());
    for (row, scale) in numbers.chunks_exact_mut(columns).zip(scale) {
        row.iter_mut().for_each(|w| *w *= scale);
    }
    numbers
}

fn flat<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().iter::<f32>().collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use burn::tensor::{Device, TensorData};
    use dynaskin_body::{REGION_COUNT, SHAPE_COUNT};
    use dynaskin_runtime::features::{FeatureKind, MATERIAL_COUNT};
    use dynaskin_runtime::{Predictor as Plan, PredictorSession};
    use dynaskin_sim::{COMPLIANCE_COUNT, ComplianceRow, ComplianceTable, SimSettings};
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::dynaskin::build::Build;
    use crate::dynaskin::locality::Locality;
    use crate::dynaskin::predictor::Window;
    use crate::dynaskin::spin::SPIN_COUNT;
    use crate::fixture;
    use crate::normaliser::Normaliser;

    const KIND: FeatureKind = FeatureKind::InertialMaterials;
    const FRAMES: usize = 12;

    /// A body of known thickness and perhaps compliance, and the inputs of a network from it after
    /// learning from bodies with β within ±1.
    fn build(table: Option<&ComplianceTable>) -> Build {
        let mut model = fixture::symmetric_body(4);
        let vertices = model.vertex_count();
        let share = |region: usize| move |v: usize| f32::from(u8::from(v % REGION_COUNT == region));
        model.region_weights = (0..REGION_COUNT)
            .map(|region| (0..vertices).map(share(region)).collect())
            .collect();
        model.thickness_template_m = (0..vertices).map(|v| 0.01 * (v + 1) as f32).collect();
        model.thickness_shape_dirs_m = (0..SHAPE_COUNT)
            .map(|k| {
                (0..vertices)
                    .map(|v| 0.001 * ((k * v) % 5) as f32)
                    .collect()
            })
            .collect();
        let mut build = Build::of_body(&model, table);
        let bodies = [-1.0f32, 1.0].map(|x| vec![x; MATERIAL_COUNT + SHAPE_COUNT]);
        build.fit(bodies.iter().map(Vec::as_slice), 0.3);
        build
    }

    #[test]
    fn the_file_plays_what_was_trained_for_bodies_within_and_beyond_what_was_learned() {
        the_file_plays_what_was_trained(build(None));
    }

    #[test]
    fn so_it_does_where_compliance_is_known() {
        let row = |index: usize| ComplianceRow {
            shape: ComplianceTable::shape(index),
            metres: Some((0..COMPLIANCE_COUNT).map(|n| length_m(n, index)).collect()),
        };
        let rows = (0..200).map(row).collect();
        let table = ComplianceTable::new("", SimSettings::default(), rows);
        let build = build(Some(&table));
        assert_eq!(
            build.count(),
            MATERIAL_COUNT + SHAPE_COUNT + COMPLIANCE_COUNT
        );
        the_file_plays_what_was_trained(build);
    }

    /// A length that depends on the shape with this index, and on which number it is.
    fn length_m(number: usize, index: usize) -> f32 {
        let shape = ComplianceTable::shape(index);
        let one = shape[number % SHAPE_COUNT];
        0.01 * (0.3 * one + 0.1 * one * shape[(number + 3) % SHAPE_COUNT]).exp()
    }

    fn the_file_plays_what_was_trained(build: Build) {
        let sizes = PredictorSizes {
            motion: PredictorInputs::MOTION_COUNT,
            conditions: build.count(),
            encoding: 12,
            springs: 10,
            hidden: 6,
            latent: 8,
        };
        let device = Device::flex();
        device.seed(3);
        let locality = Locality::everywhere(sizes.motion, sizes.conditions, sizes.latent);
        let predictor = Predictor::new(sizes, &locality, &device);
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        let mut numbers = |count: usize| -> Vec<f32> {
            (0..count).map(|_| rng.random_range(-1.5..1.5)).collect()
        };
        let normaliser = Normaliser {
            origin: numbers(KIND.count()),
            scale: numbers(KIND.count())
                .iter()
                .map(|x| 0.2 + x.abs())
                .collect(),
            motion: KIND.motion_count(),
        };
        let inputs = PredictorInputs {
            normaliser,
            spin: Spin {
                scale: numbers(SPIN_COUNT),
            },
            build,
        };
        let deviation_m = vec![0.002; sizes.latent];
        let onnx = predictor_onnx(&predictor, &inputs, &deviation_m, Precision::Single);
        let plan = Plan::load(&onnx.expect("a file")).expect("a plan");
        let mut session = PredictorSession::new(Arc::new(plan)).expect("a session");
        for reach in [0.6, 3.0] {
            let body: Vec<f32> = numbers(MATERIAL_COUNT + SHAPE_COUNT)
                .iter()
                .map(|x| reach * x)
                .collect();
            let motion = numbers(FRAMES * KIND.motion_count());
            let features: Vec<f32> = motion
                .chunks_exact(KIND.motion_count())
                .flat_map(|frame| frame.iter().chain(&body).copied())
                .collect();
            let matrix = |numbers: Vec<f32>, columns: usize| {
                let shape = [numbers.len() / columns, columns];
                Tensor::<2>::from_data(TensorData::new(numbers, shape), &device)
            };
            let window = Window {
                motion: matrix(inputs.motion(&features), sizes.motion),
                condition: matrix(inputs.build.of(&body).repeat(FRAMES), sizes.conditions),
                keep: vec![None; FRAMES],
                lanes: 1,
            };
            let (latents, _) = predictor.forward(&window, predictor.rest_state(1, &device));
            let trained: Vec<f32> = latents.into_data().iter::<f32>().collect();
            let mut state = session.predictor().zero_state();
            let mut latent = vec![0.0; sizes.latent];
            let mut largest = 0.0f32;
            for (frame, expected) in features
                .chunks_exact(KIND.count())
                .zip(trained.chunks_exact(sizes.latent))
            {
                session
                    .step(frame, &mut state, &mut latent)
                    .expect("a step");
                for (latent, expected) in latent.iter().zip(expected) {
                    let error = (latent / deviation_m[0] - expected).abs();
                    largest = largest.max(expected.abs());
                    assert!(error < 2e-5 * largest.max(1.0), "{latent} {expected}");
                }
            }
            assert!(largest > 0.1, "{largest}");
        }
    }
}
