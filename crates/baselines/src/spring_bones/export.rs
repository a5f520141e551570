//! Spring bones as ONNX files of the project's contract (ARCHITECTURE.md, "ONNX").

use dynaskin_onnx::{Graph, Precision};

use super::KIND;
use super::rig::Rig;
use super::tuning::Spring;
use dynaskin_train::TrainError;

/// `predictor.onnx`: the tips' positions and velocities are the states `state_q` and `state_v`
/// [1,axes]; the latent [1,axes] is where the tips are, in metres.
///
/// # Errors
/// [`TrainError::Onnx`].
pub(super) fn predictor_onnx(rig: &Rig, springs: &[Spring]) -> Result<Vec<u8>, TrainError> {
    let (count, axes) = (KIND.count(), rig.axes());
    let single = Precision::Single;
    let mut graph = Graph::new("predictor");
    let features = graph.input("features", &[1, count])?;
    let position = graph.input("state_q", &[1, axes])?;
    let velocity = graph.input("state_v", &[1, axes])?;

    let rest = graph.weights("rest", &[count], &rig.rest, single)?;
    let centred = graph.sub(&features, &rest)?;
    let linear = graph.weights("linear", &[count, axes], &rig.linear(), single)?;
    let drive = graph.matmul(&centred, &linear)?;
    let (firsts, seconds) = rig.factors();
    let mut factors = Vec::new();
    for (name, features) in [("first", &firsts), ("second", &seconds)] {
        let numbers = selection(count, features);
        let pick = graph.weights(name, &[count, features.len()], &numbers, single)?;
        factors.push(graph.matmul(&centred, &pick)?);
    }
    let products = graph.mul(&factors[0], &factors[1])?;
    let shape = [firsts.len(), axes];
    let quadratic = graph.weights("quadratic", &shape, &rig.quadratic(), single)?;
    let centrifugal = graph.matmul(&products, &quadratic)?;
    let drive = graph.add(&drive, &centrifugal)?;

    let mut per_axis = |name: &str, of: &dyn Fn(&Spring) -> f64| {
        let numbers: Vec<f32> = springs.iter().flat_map(|s| [of(s) as f32; 3]).collect();
        graph.weights(name, &[axes], &numbers, single)
    };
    let push = per_axis("push", &|spring| spring.gain * spring.ticks().push)?;
    let stiffness = per_axis("stiffness", &|spring| spring.ticks().stiffness)?;
    let retained = per_axis("retained", &|spring| spring.ticks().retained)?;
    let kept = graph.mul(&velocity, &retained)?;
    let pull = graph.mul(&position, &stiffness)?;
    let push = graph.mul(&drive, &push)?;
    let velocity = graph.sub(&kept, &pull)?;
    let velocity = graph.sub(&velocity, &push)?;
    let position = graph.add(&position, &velocity)?;
    graph.output("latent", &position)?;
    graph.output("state_q_out", &position)?;
    graph.output("state_v_out", &velocity)?;
    Ok(graph.into_bytes())
}

/// `decoder.onnx`: every vertex follows the tips by its region weights.
///
/// # Errors
/// [`TrainError::Onnx`].
pub(super) fn decoder_onnx(rig: &Rig) -> Result<Vec<u8>, TrainError> {
    let axes = rig.axes();
    let skin = rig.skin();
    let coordinates = skin.len() / axes;
    let mut graph = Graph::new("decoder");
    let latent = graph.input("latent", &[1, axes])?;
    let skin = graph.weights("skin", &[axes, coordinates], &skin, Precision::Half)?;
    let flat = graph.matmul(&latent, &skin)?;
    let offsets = graph.reshape(&flat, &[1, coordinates / 3, 3])?;
    graph.output("offsets", &offsets)?;
    Ok(graph.into_bytes())
}

/// A matrix that picks `features`, `[feature][pick]`.
fn selection(count: usize, features: &[usize]) -> Vec<f32> {
    let mut matrix = vec![0.0; count * features.len()];
    for (column, feature) in features.iter().enumerate() {
        matrix[feature * features.len() + column] = 1.0;
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynaskin_evaluate::Player;
    use dynaskin_train::fixture;

    #[test]
    fn the_exported_springs_swing_as_the_tuned_ones() {
        let body = fixture::symmetric_body(4);
        let rig = Rig::of_body(&body, &(0..8).collect::<Vec<u32>>()).expect("a rig");
        let spring = Spring {
            region: "belly",
            frequency_hz: 3.0,
            damping_ratio: 0.2,
            gain: 0.7,
            explained: 1.0,
        };
        let predictor = predictor_onnx(&rig, &[spring]).expect("a predictor");
        let decoder = decoder_onnx(&rig).expect("a decoder");
        let mut player = Player::new(KIND, &predictor, &decoder).expect("networks");
        let mut features = Vec::new();
        for tick in 0..90 {
            let wave = (tick as f32 * 0.31).sin();
            let mut frame = rig.rest.clone();
            for (index, x) in frame[..90].iter_mut().enumerate() {
                *x += wave * (1.0 + 0.1 * (index % 7) as f32);
            }
            features.extend(frame);
        }
        let offsets = player.play(&features).expect("offsets");
        let (ticks, drive) = (spring.ticks(), rig.drive(&features));
        let (mut q, mut v) = ([0.0f64; 3], [0.0f64; 3]);
        for (frame, drive) in offsets.chunks_exact(24).zip(drive.chunks_exact(3)) {
            for axis in 0..3 {
                let push = spring.gain * ticks.push * f64::from(drive[axis]);
                v[axis] = ticks.retained * v[axis] - ticks.stiffness * q[axis] - push;
                q[axis] += v[axis];
                // All vertices are belly through and through.
                let got = f64::from(frame[axis]);
                assert!((got - q[axis]).abs() < 1e-6 + 1e-5 * q[axis].abs());
            }
        }
        assert!(offsets.iter().any(|x| x.abs() > 1e-3), "nothing moved");
    }
}
