// Storage of the compliance in 16 bits: four numbers in 8 bytes. They are unpacked by a function of every WGSL; 16-bit
// arithmetic, which few adapters offer, is not asked for.

@group(0) @binding(0) var<storage, read> compliance: array<vec2<u32>>;

fn four(at: u32) -> vec4<f32> {
    let packed = compliance[at];
    return vec4<f32>(unpack2x16float(packed.x), unpack2x16float(packed.y));
}

fn one(at: u32) -> f32 {
    let pair = unpack2x16float(compliance[at >> 2u][(at >> 1u) & 1u]);
    return pair[at & 1u];
}
