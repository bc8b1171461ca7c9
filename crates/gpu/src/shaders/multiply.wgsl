// u = Σ_k C[:, columns[k]] forces[k], read after f32.wgsl or f16.wgsl, which give `four` and `one`.
//
// A job is a list of vec4<u32> (plan.rs writes it):
//   job[0]         n_out, numbers of the result; stride, numbers of a column, a multiple of 4; n_slices; n_first
//   job[1]         scale of the result as bits of an f32; place of the listed rows; groups of four sets; 0
//   job[2 + panel] first entry's place; entries; entries of a slice; 1 to add to the partial sums, 0 to set them
//   entries        candidate within its panel; force along x, y, z as bits of f32
//   entries of a batch: candidate; then for each group of four sets the four forces along x, along y, along z
//   listed rows    four to a vec4
//
// Each sum is compensated (Knuth's two-sum): its error stays that of a few roundings at any number of contacts.

@group(0) @binding(1) var<storage, read> job: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read_write> partials: array<f32>;
// The panel that is bound at binding 0.
@group(0) @binding(3) var<uniform> which_panel: vec4<u32>;

// Sum and what rounding has left out of it.
struct Sum {
    value: vec4<f32>,
    left_out: vec4<f32>,
}

// The same number, which the compiler cannot know to be the same: some cancel a sum against its terms as if there
// were no rounding, and nothing is left out then. Mesa's does.
fn opaque(number: vec4<f32>) -> vec4<f32> {
    return bitcast<vec4<f32>>(bitcast<vec4<u32>>(number) ^ vec4<u32>(job[1].w));
}

fn add(sum: Sum, term: vec4<f32>) -> Sum {
    let total = opaque(sum.value + term);
    let of_term = opaque(total - sum.value);
    let of_sum = total - of_term;
    let left_out = (sum.value - of_sum) + (term - of_term);
    return Sum(total, sum.left_out + left_out);
}

fn store(at: u32, value: vec4<f32>, adds: bool) {
    for (var k = 0u; k < 4u; k++) {
        if adds {
            partials[at + k] += value[k];
        } else {
            partials[at + k] = value[k];
        }
    }
}

// All rows, four numbers of the column each; y: slice of the entries.
@compute @workgroup_size(64)
fn whole(@builtin(global_invocation_id) id: vec3<u32>) {
    let stride = job[0].y;
    let fours = stride / 4u;
    if id.x >= fours {
        return;
    }
    let panel = job[2u + which_panel.x];
    let begin = panel.x + id.y * panel.z;
    let end = min(begin + panel.z, panel.x + panel.y);
    var sum = Sum(vec4<f32>(), vec4<f32>());
    for (var e = begin; e < end; e++) {
        let entry = job[e];
        let f = bitcast<vec3<f32>>(entry.yzw);
        let at = entry.x * 3u * fours + id.x;
        sum = add(sum, four(at) * f.x + four(at + fours) * f.y + four(at + 2u * fours) * f.z);
    }
    store(id.y * stride + 4u * id.x, sum.value + sum.left_out, panel.w == 1u);
}

// The first rows and the listed ones, one number of the result each; y: slice of the entries.
@compute @workgroup_size(64)
fn some_rows(@builtin(global_invocation_id) id: vec3<u32>) {
    let head = job[0];
    if id.x >= head.x {
        return;
    }
    let stride = head.y;
    var row = id.x / 3u;
    if row >= head.w {
        let listed = row - head.w;
        row = job[job[1].y + listed / 4u][listed % 4u];
    }
    let number = 3u * row + id.x % 3u;
    let panel = job[2u + which_panel.x];
    let begin = panel.x + id.y * panel.z;
    let end = min(begin + panel.z, panel.x + panel.y);
    var sum = Sum(vec4<f32>(), vec4<f32>());
    for (var e = begin; e < end; e++) {
        let entry = job[e];
        let f = bitcast<vec3<f32>>(entry.yzw);
        let at = entry.x * 3u * stride + number;
        let term = one(at) * f.x + one(at + stride) * f.y + one(at + 2u * stride) * f.z;
        sum = add(sum, vec4<f32>(term, 0.0, 0.0, 0.0));
    }
    let value = sum.value.x + sum.left_out.x;
    let place = id.y * stride + id.x;
    if panel.w == 1u {
        partials[place] += value;
    } else {
        partials[place] = value;
    }
}

// All rows under several sets of forces; y: group of four sets. The partial sums of a set are its displacement.
@compute @workgroup_size(64)
fn batch(@builtin(global_invocation_id) id: vec3<u32>) {
    let stride = job[0].y;
    let fours = stride / 4u;
    if id.x >= fours {
        return;
    }
    let panel = job[2u + which_panel.x];
    let length = 1u + 3u * job[1].z;
    var sums: array<Sum, 4>;
    for (var e = 0u; e < panel.y; e++) {
        let entry = panel.x + e * length;
        let at = job[entry].x * 3u * fours + id.x;
        let forces = entry + 1u + 3u * id.y;
        let x = bitcast<vec4<f32>>(job[forces]);
        let y = bitcast<vec4<f32>>(job[forces + 1u]);
        let z = bitcast<vec4<f32>>(job[forces + 2u]);
        let along_x = four(at);
        let along_y = four(at + fours);
        let along_z = four(at + 2u * fours);
        for (var k = 0u; k < 4u; k++) {
            sums[k] = add(sums[k], along_x * x[k] + along_y * y[k] + along_z * z[k]);
        }
    }
    for (var k = 0u; k < 4u; k++) {
        let value = sums[k].value + sums[k].left_out;
        store((4u * id.y + k) * stride + 4u * id.x, value, panel.w == 1u);
    }
}
