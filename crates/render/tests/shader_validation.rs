//! Every shader parses, validates and, where WebGL2 draws with it, translates to GLSL ES 3.00.
//! Needs no GPU.

use dynaskin_render::Shader;
use naga::back::glsl;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};

fn validated(shader: &Shader) -> Result<(naga::Module, ModuleInfo), String> {
    let wgsl = shader.wgsl();
    let module = naga::front::wgsl::parse_str(&wgsl)
        .map_err(|error| format!("{}: {}", shader.name, error.emit_to_string(&wgsl)))?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .map_err(|error| format!("{}: {}", shader.name, error.emit_to_string(&wgsl)))?;
    Ok((module, info))
}

fn glsl_es_300(shader: &Shader) -> Result<(), String> {
    let (module, info) = validated(shader)?;
    let options = glsl::Options {
        version: glsl::Version::Embedded {
            version: 300,
            is_webgl: true,
        },
        ..glsl::Options::default()
    };
    for entry in &module.entry_points {
        let pipeline = glsl::PipelineOptions {
            shader_stage: entry.stage,
            entry_point: entry.name.clone(),
            multiview: None,
        };
        let mut text = String::new();
        glsl::Writer::new(
            &mut text,
            &module,
            &info,
            &options,
            &pipeline,
            Default::default(),
        )
        .and_then(|mut writer| writer.write())
        .map_err(|error| format!("{}: {}: {error}", shader.name, entry.name))?;
        if !text.starts_with("#version 300 es") || !text.contains("void main()") {
            return Err(format!(
                "{}: {}: no GLSL ES 3.00 came out",
                shader.name, entry.name
            ));
        }
    }
    Ok(())
}

#[test]
fn every_shader_validates() {
    let failures: Vec<String> = Shader::ALL
        .iter()
        .filter_map(|s| validated(s).err())
        .collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn webgl2_shaders_translate_to_glsl_es_300() {
    let webgl2: Vec<&Shader> = Shader::ALL.iter().filter(|s| s.on_webgl2).collect();
    assert_eq!(webgl2.len(), 7);
    let failures: Vec<String> = webgl2.iter().filter_map(|s| glsl_es_300(s).err()).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn skinning_is_written_once() {
    let with_skinning = Shader::ALL
        .iter()
        .filter(|shader| shader.wgsl().contains("world_from_rest[joints.x]"));
    let names: Vec<&str> = with_skinning.map(|shader| shader.name).collect();
    assert_eq!(
        names,
        [
            "skin",
            "body_skinning",
            "shadow_skinning",
            "body_decoded",
            "shadow_decoded"
        ]
    );
}
