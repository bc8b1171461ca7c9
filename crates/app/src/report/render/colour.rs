//! A colour scale of even steps: lightness grows with the value, from deep violet over teal to a
//! light yellow, so that it reads the same in grey and for every common colour vision.

/// Lightness, chroma and hue (degrees) in Oklch (Ottosson 2020) at equal distances along the
/// scale. Lightness is linear; hue turns one way; chroma is what the screen can show.
const STOPS: [[f64; 3]; 7] = [
    [0.30, 0.135, 292.0],
    [0.40, 0.140, 268.0],
    [0.50, 0.110, 240.0],
    [0.60, 0.100, 196.0],
    [0.70, 0.125, 160.0],
    [0.80, 0.165, 128.0],
    [0.90, 0.165, 100.0],
];

/// Colour of a value that is not a number.
const MISSING: [f32; 3] = [0.75, 0.75, 0.75];

/// The scale at 256 equal distances, sRGB from 0 to 1.
pub(crate) fn map() -> [[f32; 3]; 256] {
    std::array::from_fn(|i| {
        let t = i as f64 / 255.0 * (STOPS.len() - 1) as f64;
        let k = (t as usize).min(STOPS.len() - 2);
        // Between the stops through a and b, where a straight line has no kink in colour.
        let share = t - k as f64;
        let (from, to) = (oklab(STOPS[k]), oklab(STOPS[k + 1]));
        let lab = [0, 1, 2].map(|c| from[c] + share * (to[c] - from[c]));
        srgb(lab)
    })
}

/// Colour of `value`, clamped to 0..1.
pub(crate) fn at(map: &[[f32; 3]; 256], value: f32) -> [f32; 3] {
    if value.is_nan() {
        return MISSING;
    }
    map[(value.clamp(0.0, 1.0) * 255.0 + 0.5) as usize]
}

fn oklab([lightness, chroma, hue]: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = hue.to_radians().sin_cos();
    [lightness, chroma * cos, chroma * sin]
}

/// sRGB of an Oklab colour; chroma is reduced until the screen can show it.
fn srgb([lightness, a, b]: [f64; 3]) -> [f32; 3] {
    let mut share = 1.0;
    loop {
        let linear = linear_rgb([lightness, a * share, b * share]);
        if linear.iter().all(|c| (-1e-4..=1.0001).contains(c)) || share < 0.05 {
            return linear.map(|c| gamma(c.clamp(0.0, 1.0)) as f32);
        }
        share *= 0.98;
    }
}

/// Ottosson's inverse matrices (public domain).
fn linear_rgb([lightness, a, b]: [f64; 3]) -> [f64; 3] {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
}

fn gamma(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(rgb: [f32; 3]) -> f64 {
        let [r, g, b] = rgb.map(|c| {
            let c = f64::from(c);
            if c <= 0.040_45 {
                c / 12.92
            } else {
                ((c + 0.055) / 1.055).powf(2.4)
            }
        });
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    #[test]
    fn the_scale_only_gets_lighter_and_never_jumps() {
        let map = map();
        for pair in map.windows(2) {
            assert!(luminance(pair[1]) > luminance(pair[0]) - 1e-4);
            for c in 0..3 {
                assert!((pair[1][c] - pair[0][c]).abs() < 0.03, "{pair:?}");
            }
        }
        assert!(luminance(map[0]) < 0.05);
        assert!(luminance(map[255]) > 0.6);
    }

    #[test]
    fn white_and_black_are_where_they_belong() {
        for (lightness, expected) in [(0.0, 0.0), (1.0, 1.0)] {
            for c in srgb([lightness, 0.0, 0.0]) {
                assert!((c - expected).abs() < 1e-3, "{c}");
            }
        }
    }

    #[test]
    fn what_lies_beyond_the_scale_is_clamped() {
        let map = map();
        assert_eq!(at(&map, -1.0), map[0]);
        assert_eq!(at(&map, 7.0), map[255]);
        assert_eq!(at(&map, f32::INFINITY), map[255]);
        assert_eq!(at(&map, f32::NAN), MISSING);
    }
}
