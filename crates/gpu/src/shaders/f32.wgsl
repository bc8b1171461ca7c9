// Storage of the compliance in 32 bits: four numbers in 16 bytes.

@group(0) @binding(0) var<storage, read> compliance: array<vec4<f32>>;

fn four(at: u32) -> vec4<f32> {
    return compliance[at];
}

fn one(at: u32) -> f32 {
    return compliance[at >> 2u][at & 3u];
}
