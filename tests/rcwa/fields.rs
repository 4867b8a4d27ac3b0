//! Fields in the photodiodes: their squares are the absorption, and mirrors turn them as they must.

use quadpixel::em::rcwa::{PhotodiodeFields, RcwaModel};

use super::small;

#[test]
fn squares_of_the_fields_are_what_the_photodiodes_absorb() {
    let (stack, settings) = small();
    let model = RcwaModel::new(&stack, 550.0, &settings).unwrap();
    for [u, v] in [[0.0, 0.0], [0.3, 0.0], [-0.2, 0.1]] {
        let light = model.solve(u, v).unwrap();
        let fields = model.photodiode_fields(u, v).unwrap();
        let [x, y] = [0, 1].map(|polarization| fields.product(&fields, polarization));
        for (i, absorbed) in light.mean.absorbed.iter().enumerate() {
            // The mean over two polarizations is that over any other two.
            let by_fields = 0.5 * (x[i].re + y[i].re);
            assert!(
                (by_fields - absorbed).abs() < 2e-6,
                "{u} {v}: {by_fields} {absorbed}"
            );
        }
    }
}

/// Products with a third wave hold the phase and its sign.
fn assert_alike(a: &PhotodiodeFields, b: &PhotodiodeFields, third: &PhotodiodeFields) {
    for polarization in [0, 1] {
        let (a, b) = (
            third.product(a, polarization),
            third.product(b, polarization),
        );
        assert!(a.iter().any(|a| a.norm() > 1e-3), "{a:?}");
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).norm() < 1e-5, "{a} {b}");
        }
    }
}

#[test]
fn light_from_the_other_side_is_the_mirror_image() {
    let (stack, settings) = small();
    let model = RcwaModel::new(&stack, 550.0, &settings).unwrap();
    let [other, zero, here] = [-0.25, 0.0, 0.25].map(|u| model.photodiode_fields(u, 0.0).unwrap());
    assert_alike(&other, &here.mirrored_x(), &zero);
}

#[test]
fn light_from_all_quarters_is_the_image_of_one_in_mirrors_along_x_and_y_and_between_them() {
    let (stack, settings) = small();
    let model = RcwaModel::new(&stack, 550.0, &settings).unwrap();
    let of = |u, v| model.photodiode_fields(u, v).unwrap();
    // A third wave without symmetry, so that no sign is lost.
    let (here, third) = (of(0.25, 0.1), of(0.15, -0.2));
    assert_alike(&of(-0.25, 0.1), &here.mirrored_x(), &third);
    assert_alike(&of(0.25, -0.1), &here.mirrored_y(), &third);
    assert_alike(&of(-0.25, -0.1), &here.mirrored_x().mirrored_y(), &third);
    assert_alike(&of(0.1, 0.25), &here.transposed(), &third);
    // A wave in a mirror's plane, which is solved by parities, is its own image.
    let along_y = of(0.0, 0.2);
    assert_alike(&along_y, &along_y.mirrored_x(), &third);
    assert_alike(&of(0.0, -0.2), &along_y.mirrored_y(), &third);
    assert_alike(&of(0.2, 0.0), &along_y.transposed(), &third);
}
