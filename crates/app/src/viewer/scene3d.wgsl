// Part, tool, lines and arrows under a parallel projection. Colours are as they are shown, without conversion.

struct View {
    view_projection: mat4x4<f32>,
    // Unit vector towards the light; w: share of the light that shade keeps.
    to_light: vec4<f32>,
    // Unit vector from the eye into the picture.
    into: vec4<f32>,
    // Width and height of the picture, pixels; how far lines stand before their surface, of the depth.
    frame: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;
// The colour scale, 256 wide.
@group(0) @binding(1) var colours: texture_2d<f32>;
// From the body's frame to the world.
@group(1) @binding(0) var<uniform> body: mat4x4<f32>;

struct Lit {
    @builtin(position) place: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) paint: vec4<f32>,
}

@vertex
fn vertex_lit(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) paint: vec4<f32>,
) -> Lit {
    var out: Lit;
    out.place = view.view_projection * body * vec4(position, 1.0);
    out.normal = (body * vec4(normal, 0.0)).xyz;
    out.paint = paint;
    return out;
}

// The side of a surface that is seen.
fn towards_eye(normal: vec3<f32>) -> vec3<f32> {
    let n = normal / max(length(normal), 1e-30);
    return select(n, -n, dot(n, view.into.xyz) > 0.0);
}

fn lit(colour: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    let light = view.to_light.w + (1.0 - view.to_light.w) * max(dot(n, view.to_light.xyz), 0.0);
    let between = normalize(view.to_light.xyz - view.into.xyz);
    let shine = 0.10 * pow(max(dot(n, between), 0.0), 36.0);
    return min(colour * light + shine, vec3(1.0));
}

@fragment
fn fragment_part(in: Lit) -> @location(0) vec4<f32> {
    let along = clamp(in.paint.x, 0.0, 1.0) * 255.0;
    let below = i32(along);
    let a = textureLoad(colours, vec2(below, 0), 0).rgb;
    let b = textureLoad(colours, vec2(min(below + 1, 255), 0), 0).rgb;
    return vec4(lit(mix(a, b, fract(along)), towards_eye(in.normal)), 1.0);
}

@fragment
fn fragment_solid(in: Lit) -> @location(0) vec4<f32> {
    return vec4(lit(in.paint.rgb, towards_eye(in.normal)), 1.0);
}

// What is behind something else.
@fragment
fn fragment_hidden(in: Lit) -> @location(0) vec4<f32> {
    return vec4(in.paint.rgb, 0.30);
}

// Glass is seen best where it is grazed.
@fragment
fn fragment_glass(in: Lit) -> @location(0) vec4<f32> {
    let n = towards_eye(in.normal);
    let grazing = 1.0 - abs(dot(n, view.into.xyz));
    return vec4(lit(in.paint.rgb, n), in.paint.a + 0.42 * grazing * grazing);
}

struct Inked {
    @builtin(position) place: vec4<f32>,
    @location(0) colour: vec4<f32>,
}

// A line of some pixels' width, as two triangles.
@vertex
fn vertex_line(
    @builtin(vertex_index) corner: u32,
    @location(0) from_end: vec3<f32>,
    @location(1) to_end: vec3<f32>,
    @location(2) colour: vec4<f32>,
    @location(3) width: f32,
) -> Inked {
    let p = view.view_projection * body * vec4(from_end, 1.0);
    let q = view.view_projection * body * vec4(to_end, 1.0);
    let way = (q.xy - p.xy) * view.frame.xy;
    let along = way / max(length(way), 1e-6);
    let side = vec2(-along.y, along.x) * width / view.frame.xy;
    let is_far = corner == 1u || corner == 2u || corner == 4u;
    let is_left = corner == 2u || corner == 4u || corner == 5u;
    let end = select(p, q, is_far);
    var out: Inked;
    out.place = vec4(
        end.xy + select(-side, side, is_left),
        clamp(end.z - view.frame.z, 0.0, 1.0),
        1.0,
    );
    out.colour = colour;
    return out;
}

@fragment
fn fragment_line(in: Inked) -> @location(0) vec4<f32> {
    return in.colour;
}
