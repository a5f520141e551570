//! The shaders that the SDK's adapters hand to engines are those of this crate.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use dynaskin_decoding::{COMPUTE, FRAGMENT, MAX_SLOTS, MESH, MESH_COMPUTE, SHARED, WIDTH};
use naga::ShaderStage;
use naga::back::glsl;
use naga::valid::{Capabilities, ValidationFlags, Validator};

/// The module, of which naga finds that it is one.
fn checked(wgsl: String) -> String {
    let module = naga::front::wgsl::parse_str(&wgsl).unwrap();
    Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .unwrap();
    wgsl
}

/// The module's entry point as GLSL ES 3.00, as wgpu translates it for WebGL2.
fn glsl(wgsl: &str, stage: ShaderStage, entry_point: &str) -> String {
    let module = naga::front::wgsl::parse_str(wgsl).unwrap();
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .unwrap();
    let options = glsl::Options {
        version: glsl::Version::Embedded {
            version: 300,
            is_webgl: true,
        },
        // The first row of a texture is that of the lowest y.
        writer_flags: glsl::WriterFlags::ADJUST_COORDINATE_SPACE,
        ..glsl::Options::default()
    };
    let pipeline = glsl::PipelineOptions {
        shader_stage: stage,
        entry_point: entry_point.to_owned(),
        multiview: None,
    };
    let mut text = String::new();
    let bounds = Default::default();
    glsl::Writer::new(&mut text, &module, &info, &options, &pipeline, bounds)
        .unwrap()
        .write()
        .unwrap();
    text
}

/// The file of the SDK.
fn expected() -> String {
    let fragment = [SHARED, FRAGMENT].join("\n");
    let mesh = [SHARED, FRAGMENT, MESH].join("\n");
    let constants = [
        (
            "POSITIONS_VERTEX",
            "GLSL of a quad over the rows of one body.",
            glsl(&fragment, ShaderStage::Vertex, "vs_slot"),
        ),
        (
            "POSITIONS_FRAGMENT",
            "GLSL that decodes positions into a texture.",
            glsl(&fragment, ShaderStage::Fragment, "fs_positions"),
        ),
        (
            "MESH_VERTEX",
            "GLSL whose output is captured: positions and normals of a mesh's vertices.",
            glsl(&mesh, ShaderStage::Vertex, "vs_mesh"),
        ),
        (
            "COMPUTE",
            "WGSL of the passes `decode_positions`, of a batch, and `decode_mesh`, of the vertices of a mesh.",
            checked([SHARED, COMPUTE, MESH_COMPUTE].join("\n")),
        ),
    ];
    let mut file = format!(
        "// Written by the tests of the Rust crate dynaskin-decoding from its WGSL, by naga; do not edit. After a change there:\n\
         // DYNASKIN_WRITE_GOLDEN=1 cargo test -p dynaskin-decoding --test engine_shaders\n\n\
         /** Texels of a row. */\nexport const WIDTH = {WIDTH};\n\n\
         /** Bodies of a batch at most. */\nexport const MAX_SLOTS = {MAX_SLOTS};\n"
    );
    for (name, what, text) in constants {
        // Browsers have no use for comments.
        let lines = text.lines().map(str::trim_end);
        let lines: Vec<&str> = lines
            .filter(|line| !line.trim_start().starts_with("//"))
            .collect();
        let text = lines.join("\n");
        assert!(!text.contains(['`', '\\']) && !text.contains("${"));
        file += &format!(
            "\n/** {what} */\nexport const {name} = `{}\n`;\n",
            text.trim_end()
        );
    }
    file
}

#[test]
fn the_shaders_of_the_sdk_are_those_of_this_crate() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../web/sdk/src/adapter/decoding-shaders.ts");
    let expected = expected();
    if std::env::var_os("DYNASKIN_WRITE_GOLDEN").is_some() {
        std::fs::write(&path, &expected).unwrap();
    }
    let present = std::fs::read_to_string(&path).unwrap();
    assert!(
        present == expected,
        "{} differs from the WGSL; run this test with DYNASKIN_WRITE_GOLDEN=1 and commit the file",
        path.display()
    );
}
