use super::*;

const ORDERS: [FaceOrder; 3] = [FaceOrder::Linear, FaceOrder::Quadratic, FaceOrder::Cubic];

/// Local coordinates of the nodes, from the drawing.
fn places(order: FaceOrder) -> Vec<[f64; 3]> {
    let mut places = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let edges = [[0, 1], [1, 2], [2, 0]];
    let shares: &[f64] = match order {
        FaceOrder::Linear => &[],
        FaceOrder::Quadratic => &[0.5],
        FaceOrder::Cubic => &[1.0 / 3.0, 2.0 / 3.0],
    };
    for [a, b] in edges {
        for share in shares {
            let mut l = [0.0; 3];
            (l[a], l[b]) = (1.0 - share, *share);
            places.push(l);
        }
    }
    if order == FaceOrder::Cubic {
        places.push([1.0 / 3.0; 3]);
    }
    places
}

/// On a bowl z = (x² + 2 y²) / 5, seen from above.
fn curved(order: FaceOrder) -> Vec<DVec3> {
    places(order)
        .iter()
        .map(|l| {
            let (x, y) = (l[1] + 0.2 * l[2], 0.9 * l[2]);
            DVec3::new(x, y, (x * x + 2.0 * y * y) / 5.0)
        })
        .collect()
}

#[test]
fn shape_functions_are_one_at_their_node_and_sum_to_one() {
    for order in ORDERS {
        let n = order.n_nodes();
        let places = places(order);
        assert_eq!(places.len(), n);
        for (place, ours) in places.iter().zip(order.node_coordinates()) {
            assert!((0..3).all(|k| (place[k] - ours[k]).abs() < 1e-15));
        }
        for (i, l) in places.iter().enumerate() {
            let (values, _) = order.shape(*l);
            for (j, value) in values[..n].iter().enumerate() {
                let expected = f64::from(u8::from(i == j));
                assert!((value - expected).abs() < 1e-14, "{order:?} {i} {j}");
            }
        }
        let (values, by_l) = order.shape([0.5, 0.2, 0.3]);
        assert!((values.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        for k in 0..3 {
            let at = |step: f64| {
                let mut l = [0.5, 0.2, 0.3];
                l[k] += step;
                order.shape(l).0
            };
            let (up, down) = (at(1e-6), at(-1e-6));
            for i in 0..n {
                let rate = (up[i] - down[i]) / 2e-6;
                assert!((by_l[i][k] - rate).abs() < 1e-8, "{order:?} {i} {k}");
            }
        }
    }
}

#[test]
fn largest_sum_is_that_of_a_fine_raster() {
    for order in ORDERS {
        let mut largest = 0.0_f64;
        for i in 0..=300 {
            for j in 0..=300 - i {
                let (a, b) = (f64::from(i) / 300.0, f64::from(j) / 300.0);
                let (values, _) = order.shape([1.0 - a - b, a, b]);
                largest = largest.max(values.iter().map(|x| x.abs()).sum());
            }
        }
        let bound = order.largest_sum();
        assert!(
            largest <= bound + 1e-12 && largest > 0.99 * bound,
            "{largest} {bound}"
        );
    }
}

/// Against a raster of the whole face, for points before, behind and beside it.
#[test]
fn nearest_point_is_that_of_a_fine_raster() {
    const N: i32 = 400;
    for order in ORDERS {
        let nodes = curved(order);
        let face = Face::new(order, &nodes);
        let mut n_inside = 0;
        for k in 0..60 {
            let t = f64::from(k);
            let p = DVec3::new(
                0.5 + 0.6 * (1.7 * t).sin(),
                0.35 + 0.4 * (2.3 * t).cos(),
                0.15 + 0.2 * (0.9 * t).sin(),
            );
            let nearest = face.nearest(p);
            let ours = (p - nearest.position).length();
            let mut best = f64::INFINITY;
            for i in 0..=N {
                for j in 0..=N - i {
                    let (a, b) = (f64::from(i) / f64::from(N), f64::from(j) / f64::from(N));
                    best = best.min((p - face.at([1.0 - a - b, a, b]).0).length());
                }
            }
            // A raster is no nearer, and less than half a cell farther.
            assert!(
                ours <= best + 1e-12 && ours > best - 2e-3,
                "{order:?} {p}: {ours} and {best}"
            );
            assert!(nearest.l.iter().all(|l| *l >= 0.0));
            let summed: DVec3 = nodes.iter().zip(nearest.weights).map(|(x, w)| w * *x).sum();
            assert!((summed - nearest.position).length() < 1e-14);
            if nearest.aside == 0.0 {
                n_inside += 1;
                assert!((nearest.height.abs() - ours).abs() < 1e-9);
            } else {
                assert!((nearest.height.hypot(nearest.aside) - ours).abs() < 1e-12);
            }
        }
        assert!(n_inside > 10 && n_inside < 50, "{n_inside}");
    }
}

/// The height is the distance: it changes with p along the normal, with a node by the share of its shape function.
#[test]
fn height_changes_as_the_row_says() {
    for order in ORDERS {
        let nodes = curved(order);
        let p = DVec3::new(0.45, 0.3, 0.08);
        let at = |nodes: &[DVec3], p: DVec3| Face::new(order, nodes).nearest(p);
        let row = at(&nodes, p);
        assert_eq!(row.aside, 0.0);
        for axis in DVec3::AXES {
            let step = 1e-6 * axis;
            let rate = (at(&nodes, p + step).height - at(&nodes, p - step).height) / 2e-6;
            assert!((rate - row.outward.dot(axis)).abs() < 1e-8);
            for a in 0..order.n_nodes() {
                let height = |sign: f64| {
                    let mut moved = nodes.clone();
                    moved[a] += sign * step;
                    at(&moved, p).height
                };
                let rate = (height(1.0) - height(-1.0)) / 2e-6;
                let expected = -row.weights[a] * row.outward.dot(axis);
                assert!(
                    (rate - expected).abs() < 1e-8,
                    "{order:?} {a}: {rate} {expected}"
                );
            }
        }
    }
}

#[test]
fn faces_without_area_give_no_number_and_no_endless_loop() {
    let nodes = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X];
    let nearest = Face::new(FaceOrder::Linear, &nodes).nearest(DVec3::Y);
    assert!(!nearest.outward.is_finite());
    let nodes = [DVec3::NAN; 3];
    let nearest = Face::new(FaceOrder::Linear, &nodes).nearest(DVec3::Y);
    assert!(!nearest.height.is_finite());
}
