//! `[accuracy]`: presets, the forms of its keys, what does not go together.

use super::*;

/// A preset is what its settings are, and a key beside it takes precedence.
#[test]
fn a_preset_sets_all_and_a_key_beside_it_wins() {
    let scene = with("title = \"Clip\"", "accuracy = \"exact\"").unwrap();
    assert_eq!(scene.part.order, Some(3));
    assert_eq!(scene.accuracy, Accuracy::of(Some(Preset::Exact)));
    let scene = adding("[accuracy]\npreset = \"fast\"\nscalar = \"f32\"\n").unwrap();
    assert_eq!(scene.part.order, None);
    assert_eq!(scene.accuracy.scalar, MultiplyScalar::F32);
    assert_eq!(
        scene.accuracy.contact_iterations,
        ContactIterations::Times(2)
    );
    let scene = adding("[accuracy]\ncontact_scalar = \"f32\"\ncolumns = \"near\"\n").unwrap();
    assert_eq!(scene.accuracy.contact_scalar, Scalar::F32);
    assert_eq!(scene.accuracy.columns, Columns::Near);
    let scene = with("title = \"Clip\"", "accuracy = { budget_us = 200 }").unwrap();
    assert_eq!(scene.accuracy.budget_us, Some(200.0));
}

/// Where the multiply runs and in which numbers; without a word the program chooses both.
#[test]
fn the_multiply_is_told_by_where_and_by_its_numbers() {
    let multiply = |keys: &str| {
        let accuracy = adding(&format!("[accuracy]\n{keys}\n")).unwrap().accuracy;
        (accuracy.multiply, accuracy.scalar)
    };
    assert_eq!(multiply(""), (Multiply::Auto, MultiplyScalar::Auto));
    assert_eq!(
        multiply("multiply = \"auto\"\nscalar = \"auto\""),
        (Multiply::Auto, MultiplyScalar::Auto)
    );
    assert_eq!(
        multiply("multiply = \"cpu\"\nscalar = \"f64\""),
        (Multiply::Cpu, MultiplyScalar::F64)
    );
    assert_eq!(
        multiply("multiply = \"gpu\"\nscalar = \"f16\""),
        (Multiply::Gpu, MultiplyScalar::F16)
    );
    assert_eq!(
        multiply("preset = \"balanced\"\nmultiply = \"gpu\""),
        (Multiply::Gpu, MultiplyScalar::Auto)
    );
}

/// The p-method is told by a radius or by a table, lengths in the scene's units.
#[test]
fn adaptive_is_off_a_radius_or_a_table() {
    let adaptive = |value: &str| {
        let text = format!("units = \"mm-N-MPa\"\naccuracy.adaptive = {value}\n{CLIP}");
        read(text).unwrap().accuracy.adaptive
    };
    assert_eq!(adaptive("\"off\""), Adaptive::Off);
    assert_eq!(adaptive("2"), Adaptive::On(FreeNodes::Radius(2e-3)));
    assert_eq!(
        adaptive("{ indicator = 0.01 }"),
        Adaptive::On(FreeNodes::Indicator(0.01))
    );
    assert_eq!(
        adaptive("{ budget_us = 50 }"),
        Adaptive::On(FreeNodes::BudgetUs(50.0))
    );
}

#[test]
fn refusals_name_line_key_and_mend() {
    refuses([
        (
            with("title = \"Clip\"", "accuracy = \"quick\""),
            "clip.toml:1: accuracy has no choice `quick`; the nearest is `exact`, all are `fast`, `balanced`, `exact`",
        ),
        (
            adding("[accuracy]\norder = 1\npreset = \"best\"\n"),
            "clip.toml:23: preset has no choice `best`; the nearest is `fast`",
        ),
        (
            read(format!(
                "accuracy = {{ order = 3 }}\n{}",
                CLIP.replace("\n\n[part]", "\n[part]\norder = 2")
            )),
            "clip.toml:1: accuracy.order 3 and part.order 2 differ; leave one of the two out",
        ),
        (
            adding("[accuracy]\nbudget_us = 0\n"),
            "clip.toml:22: budget_us 0 must be above 0; write a positive number",
        ),
        (
            adding("[accuracy]\nbudget_us = 200.0\norder = 2\n"),
            "clip.toml:22: budget_us chooses order itself, but order is written too; leave out budget_us or order",
        ),
        (
            adding("[accuracy]\nadaptive = -1.0\n"),
            "clip.toml:22: adaptive radius -1 must not be negative; write 0 or more",
        ),
        (
            adding("[accuracy]\nadaptive = \"on\"\n"),
            "clip.toml:22: adaptive has no choice `on`; the nearest is `off`, all are `off`",
        ),
        (
            adding("[accuracy]\nadaptive = {}\n"),
            "clip.toml:22: adaptive says nothing of which nodes are free; write radius, indicator or budget_us",
        ),
        (
            adding("[accuracy]\nadaptive = { radius = 1.0, indicator = 0.1 }\n"),
            "clip.toml:22: adaptive says more than once which nodes are free; keep one of radius, indicator and budget_us",
        ),
        (
            adding("[accuracy]\nadaptive = { raduis = 1.0 }\n"),
            "clip.toml:22: unknown key `raduis`; the nearest is `radius`",
        ),
        (
            adding("[accuracy]\nadaptive = 1\ncolumns = \"near\"\n"),
            "clip.toml:23: columns \"near\" and adaptive do not go together; leave columns out, or write adaptive = \"off\"",
        ),
        (
            adding("[accuracy]\nrates = \"two\"\n"),
            "clip.toml:22: rates has no choice `two`; the nearest is `auto`, all are `auto`, `one`",
        ),
        (
            adding("[accuracy]\nrates = { every = 0 }\n"),
            "clip.toml:22: rates.every 0 is out of range; write 1 to 50",
        ),
        (
            adding("[accuracy]\nrates = { every = 30 }\n[device]\nservo_period = 2e-3\n"),
            "clip.toml:22: rates.every 30 periods of 0.002 s are 0.06 s, more than 0.05 s; write 25 or less",
        ),
        (
            adding("[accuracy]\nmultiply = \"gpu\"\nscalar = \"f64\"\n"),
            "clip.toml:23: scalar \"f64\" does not go with multiply \"gpu\", which keeps 32 or 16 bits; write scalar = \"f32\" or \"f16\" or leave it out, or write multiply = \"cpu\"",
        ),
        (
            adding("[accuracy]\ncolumns = \"near\"\nmultiply = \"gpu\"\n"),
            "clip.toml:22: columns \"near\" does not go with multiply \"gpu\", which needs the whole compliance; leave one of the two out",
        ),
        (
            adding("[accuracy]\nmultiply = \"opencl\"\n"),
            "clip.toml:22: multiply has no choice `opencl`; the nearest is `",
        ),
        (
            adding("[accuracy]\ncontact_scalar = \"f16\"\n"),
            "clip.toml:22: contact_scalar has no choice `f16`; the nearest is `f64`, all are `f64`, `f32`",
        ),
        (
            adding("[accuracy]\ncontact_iterations = 0\n"),
            "clip.toml:22: contact_iterations 0 is out of range; write 1 to 50",
        ),
        (
            adding("[accuracy]\ncontact_iterations = \"convergd\"\n"),
            "clip.toml:22: contact_iterations has no choice `convergd`; the nearest is `converged`",
        ),
        (
            adding("[accuracy]\nmax_contacts = 100000\n"),
            "clip.toml:22: max_contacts 100000 is out of range; write 1 to 5000",
        ),
        (
            adding("[accuracy]\nmerge_tolerance = 5\n"),
            "clip.toml:22: merge_tolerance 5 is more than all of the force; write a share from above 0 to 1",
        ),
    ]);
}
