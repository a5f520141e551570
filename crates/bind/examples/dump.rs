use dynaskin_bind::{Avatar, BindOptions, bind};
use dynaskin_body::BodyModel;
use std::io::Write;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let body = BodyModel::from_glb(&std::fs::read(&a[1]).unwrap()).unwrap();
    let avatar = Avatar::from_glb(&std::fs::read(&a[2]).unwrap()).unwrap();
    let bound = bind(&avatar, &body, &BindOptions::adult()).unwrap();
    let mut out = std::io::BufWriter::new(std::fs::File::create(&a[3]).unwrap());
    let left = glam::Vec3::Y.cross(bound.ahead);
    let mut put = |set: u8, p: [glam::Vec3; 3], v: f32| {
        let mut row = vec![f32::from(set)];
        for q in p {
            row.extend([q.dot(left), q.y, q.dot(bound.ahead)]);
        }
        row.push(v);
        for x in row {
            out.write_all(&x.to_le_bytes()).unwrap();
        }
    };
    for (i, m) in avatar.meshes.iter().enumerate() {
        for f in &m.faces {
            let p = f.map(|c| bound.skin_m[i][c as usize]);
            let d = f
                .iter()
                .map(|c| bound.distances_m[i][*c as usize])
                .sum::<f32>()
                / 3.0
                / 0.05;
            let c = f
                .iter()
                .map(|c| bound.coverage[i][*c as usize])
                .sum::<f32>()
                / 3.0;
            put(0, p, d);
            put(1, p, c);
        }
    }
    for f in &body.faces {
        put(2, f.map(|c| bound.fitted_m[c as usize]), 0.5);
    }
    let r = &bound.binding.report;
    for m in &r.meshes {
        println!("{} {} {} {}", m.name, m.material, m.vertices, m.moving);
    }
}
