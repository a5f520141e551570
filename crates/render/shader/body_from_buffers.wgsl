// Vertex stage over the surface that the host uploaded.

@vertex
fn vs_body(in: RestVertex) -> BodyVarying {
    return skinned_body(in);
}
