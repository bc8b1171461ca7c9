// Adds the slices of the partial sums and brings the result to its scale. The job is that of multiply.wgsl.

@group(0) @binding(0) var<storage, read> job: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read> partials: array<f32>;
@group(0) @binding(2) var<storage, read_write> displacement: array<f32>;

@compute @workgroup_size(64)
fn reduce(@builtin(global_invocation_id) id: vec3<u32>) {
    let head = job[0];
    // A zero that the compiler does not know, as in multiply.wgsl.
    let zero = job[1].w;
    if id.x >= head.x {
        return;
    }
    var sum = 0.0;
    var left_out = 0.0;
    for (var slice = 0u; slice < head.z; slice++) {
        let term = partials[slice * head.y + id.x];
        let total = bitcast<f32>(bitcast<u32>(sum + term) ^ zero);
        let of_term = bitcast<f32>(bitcast<u32>(total - sum) ^ zero);
        left_out += (sum - (total - of_term)) + (term - of_term);
        sum = total;
    }
    displacement[id.x] = (sum + left_out) * bitcast<f32>(job[1].x);
}
