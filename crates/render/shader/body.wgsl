// Shades a skinned body: cloth and skin told apart by their painted colour, or the heat map.

struct Material {
    // Two linear colours that every vertex is a mixture of, where `two_tone` is 1, or 2: plaster.
    first_linear: vec3<f32>,
    two_tone: u32,
    second_linear: vec3<f32>,
    // How far from the hem a vertex is whose fourth number is 0 (in the first colour) or 1.
    hem_reach_m: f32,
}

@group(1) @binding(7) var<uniform> material: Material;

struct BodyVarying {
    @builtin(position) clip: vec4<f32>,
    @location(0) position_world_m: vec3<f32>,
    @location(1) normal_world: vec3<f32>,
    @location(2) position_rest_m: vec3<f32>,
    // Colour as painted, sRGB, and how far the material's second colour is.
    @location(3) color: vec4<f32>,
    @location(4) offset_size_m: f32,
}

fn linear_from_srgb(srgb: vec3<f32>) -> vec3<f32> {
    let low = srgb / 12.92;
    let high = pow((srgb + 0.055) / 1.055, vec3<f32>(2.4));
    return select(high, low, srgb <= vec3<f32>(0.04045));
}

fn heat_color(offset_size_m: f32) -> vec3<f32> {
    let last = f32(HEAT_STOPS - 1u);
    let along = clamp(offset_size_m * frame.inverse_heat_range_per_m, 0.0, 1.0) * last;
    let low = min(u32(along), HEAT_STOPS - 2u);
    return mix(frame.heat_ramp[low].rgb, frame.heat_ramp[low + 1u].rgb, along - f32(low));
}

// 1 on skin tones, 0 on cloth: skin is warm (red over green over blue) and not saturated.
fn skin_share(albedo: vec3<f32>) -> f32 {
    let warm = (albedo.r - albedo.b) / max(albedo.r, 1e-3);
    let ordered = smoothstep(0.0, 0.12, (albedo.g - albedo.b) / max(albedo.r, 1e-3));
    return smoothstep(0.30, 0.45, warm) * ordered;
}

struct Surface {
    albedo: vec3<f32>,
    skin_like: f32,
    // Share of the surrounding light that reaches it past a hem.
    open: f32,
}

// The painted surface. Where two colours meet, the edge is one pixel wide; beside it the cloth has
// a darker seam, and its thickness shades the skin.
fn painted_surface(in: BodyVarying) -> Surface {
    let interpolated = linear_from_srgb(in.color.rgb);
    // Metres past the edge into the second colour, and how many of them a pixel covers.
    let past_edge_m = (2.0 * in.color.a - 1.0) * material.hem_reach_m;
    let pixel_m = max(fwidth(past_edge_m), 1e-6);
    if material.two_tone == 0u {
        return Surface(interpolated, skin_share(interpolated), 1.0);
    }
    let second = clamp(past_edge_m / pixel_m + 0.5, 0.0, 1.0);
    let albedo = mix(material.first_linear, material.second_linear, second);
    let first_skin = skin_share(material.first_linear);
    let second_skin = skin_share(material.second_linear);
    // Of plaster, the lighter one stands for skin.
    let plaster_skin = material.first_linear.r - material.second_linear.r;
    let skin_first = select(first_skin - second_skin, plaster_skin, material.two_tone == 2u);
    let into_cloth_m = past_edge_m * sign(skin_first + 1e-6);
    // From afar the seam is fainter, not narrower than a pixel.
    let seam_m = max(0.0015, pixel_m);
    let seam = (1.0 - smoothstep(0.0, seam_m, abs(into_cloth_m - 0.006))) * 0.0015 / seam_m;
    let beside = smoothstep(-0.007, 0.0, into_cloth_m) * (1.0 - smoothstep(0.0, 0.0015, into_cloth_m));
    return Surface(
        albedo * (1.0 - 0.35 * seam),
        mix(first_skin, second_skin, second),
        1.0 - 0.45 * beside,
    );
}

// Knitted cloth: rows of small loops in the rest pose, 2.4 mm wide, fading out with distance
// before they would alias. Returns a factor around 1.
fn knit(position_rest_m: vec3<f32>) -> f32 {
    let footprint_m = max(length(dpdx(position_rest_m)), length(dpdy(position_rest_m)));
    let detail = clamp(1.4 - footprint_m * 1100.0, 0.0, 1.0);
    let around = atan2(position_rest_m.x, position_rest_m.z) * 420.0;
    let rows = position_rest_m.y * 2600.0;
    return 1.0 + 0.10 * detail * sin(rows + 0.9 * sin(around)) * sin(around);
}

// GGX lobe with Schlick's Fresnel and a Smith visibility approximation; n·l included.
fn highlight(normal: vec3<f32>, view: vec3<f32>, light: vec3<f32>, roughness: f32, f0: f32) -> f32 {
    let halfway = normalize(view + light);
    let n_l = max(dot(normal, light), 0.0);
    let n_v = max(dot(normal, view), 1e-3);
    let n_h = max(dot(normal, halfway), 0.0);
    let v_h = max(dot(view, halfway), 0.0);
    let alpha = roughness * roughness;
    let spread = n_h * n_h * (alpha * alpha - 1.0) + 1.0;
    let lobe = alpha * alpha / (3.14159265 * spread * spread);
    let k = 0.5 * alpha;
    let visible = 0.25 / ((n_l * (1.0 - k) + k) * (n_v * (1.0 - k) + k));
    let fresnel = f0 + (1.0 - f0) * pow(1.0 - v_h, 5.0);
    return lobe * visible * fresnel * n_l;
}

// Lambert's cosine bent around the edge, per channel, and scaled so that it reflects no more
// light: in skin, light that entered beside the edge leaves behind it, red a little farther. Much
// farther, and every hollow that turns away from the key would have a red rim, like a rash.
fn wrapped(cosine: f32, wrap: vec3<f32>) -> vec3<f32> {
    let bent = clamp((cosine + wrap) / (1.0 + wrap), vec3<f32>(0.0), vec3<f32>(1.0));
    return bent / (1.0 + wrap);
}

// Diffuse light arrives as radiance times π: this is the exposure over π.
const EXPOSURE = 0.37;

// What skin makes of the light that comes from all around: the cool room would turn it grey, but most
// of that light has been inside the skin, or comes from skin beside it.
const SKIN_SHADE = vec3<f32>(1.50, 1.24, 1.03);

struct Shading {
    diffuse: vec3<f32>,
    specular: vec3<f32>,
}

fn studio_light(in: BodyVarying, normal: vec3<f32>, view: vec3<f32>, skin_like: f32) -> Shading {
    let wrap = mix(vec3<f32>(0.12), vec3<f32>(0.17, 0.15, 0.14), skin_like);
    let roughness = mix(0.82, 0.47, skin_like);
    let f0 = mix(0.022, 0.030, skin_like);

    let n_key = dot(normal, frame.key_world);
    // Where light is bent around the edge, the body itself stands in its way, which the cosine tells
    // already: only what is farther away throws a shadow there, such as an arm.
    let past_self_m = 0.03 * (1.0 - smoothstep(-0.10, 0.12, n_key));
    let key_seen = key_visibility(in.position_world_m + past_self_m * frame.key_world, normal, 0.005);

    // The floor hides the sky from what is close to it and looks down.
    let height_m = max(in.position_world_m.y, 0.0);
    let near_floor = 1.0 - smoothstep(0.0, 0.30, height_m);
    let open = 1.0 - near_floor * (0.55 - 0.35 * normal.y);

    let fill = FILL_RADIANCE * wrapped(dot(normal, frame.fill_world), vec3<f32>(0.35));
    let around = mix(vec3<f32>(1.0), SKIN_SHADE, skin_like) * (fill + ambient(normal)) * open;
    var light: Shading;
    light.diffuse = KEY_RADIANCE * wrapped(n_key, wrap) * key_seen
        + RIM_RADIANCE * 0.55 * wrapped(dot(normal, frame.rim_world), vec3<f32>(0.0))
        + around;
    light.specular = KEY_RADIANCE * highlight(normal, view, frame.key_world, roughness, f0) * key_seen
        + FILL_RADIANCE * highlight(normal, view, frame.fill_world, roughness, f0)
        + RIM_RADIANCE * highlight(normal, view, frame.rim_world, roughness, f0);
    // Edges mirror the room: cool on skin, and fuzz catches light on cloth.
    let edge = pow(1.0 - max(dot(normal, view), 0.0), mix(3.0, 4.5, skin_like));
    light.specular += ambient(normal) * open * edge * mix(0.16, 0.22, skin_like);
    return light;
}

@fragment
fn fs_body(in: BodyVarying, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let outward = normalize(in.normal_world);
    let view = normalize(frame.eye_world_m - in.position_world_m);
    // The inside, where it is seen. Not along the outline: there a triangle that just turns away may
    // win a sample, and is lit like its neighbour.
    let inside = !front && dot(outward, view) < -0.25;
    let normal = select(outward, -outward, inside);
    let painted = painted_surface(in);
    let smooth_share = select(painted.skin_like, 1.0, material.two_tone == 2u);
    let texture = mix(knit(in.position_rest_m), 1.0, smooth_share);
    let skin_like = select(painted.skin_like, 0.3, frame.heat_on == 1u);
    let light = studio_light(in, normal, view, skin_like);

    let diffuse = painted.albedo * texture * painted.open * light.diffuse;
    let shaded = tone_mapped(EXPOSURE * diffuse + light.specular);
    // The heat map keeps the legend's colours: only brightness follows the light, gently.
    let brightness = dot(light.diffuse, vec3<f32>(0.2126, 0.7152, 0.0722));
    let relief = 0.55 + 0.45 * clamp(brightness * 0.42, 0.0, 1.0);
    let heat = heat_color(in.offset_size_m) * relief + 0.25 * light.specular;
    return displayed(select(shaded, heat, frame.heat_on == 1u), in.clip.xy);
}
