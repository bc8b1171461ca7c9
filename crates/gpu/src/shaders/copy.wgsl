// Reads one buffer and writes another: the memory bandwidth that the multiply is measured against.

@group(0) @binding(0) var<storage, read> from_here: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> to_here: array<vec4<f32>>;

@compute @workgroup_size(64)
fn copy(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>) {
    let each = n.x * 64u;
    for (var at = id.x; at < arrayLength(&from_here); at += each) {
        to_here[at] = from_here[at];
    }
}
