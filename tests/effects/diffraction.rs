//! Scenes that call for diffraction at the lens's aperture, and scenes that do not.

use quadpixel::effects::{Choice, Decision, Effect, Shot, Tolerance};
use quadpixel::scene::Scene;

use super::light::point;
use super::scenes::{Make, card};
use super::shots::boxes;
use super::{difference_percent, planned};

#[test]
fn diffraction_is_simulated_where_it_would_be_seen() {
    let phone = || {
        Make::phone(boxes(2, 2, 1.6, 4.0))
            .camera()
            .with_lens_diffraction()
    };
    let centred = Make::phone(boxes(1, 1, 1.6, 1.0))
        .on_axis()
        .camera()
        .with_lens_diffraction();
    let wide = Make::simple(boxes(1, 1, 40.0, 40.0))
        .camera()
        .with_lens_diffraction();
    let small_stop = Make::slow(boxes(2, 2, 3.5, 9.0))
        .camera()
        .with_lens_diffraction();
    let cases = [
        (
            "phone, a card in focus",
            card(&phone(), 1.0, 1.0),
            phone(),
            true,
        ),
        (
            "phone, a faint card far out of focus",
            card(&phone(), 6.0, 0.02),
            phone(),
            false,
        ),
        (
            "phone, an even wall",
            Scene::new(Vec::new(), [0.5; 3]),
            phone(),
            false,
        ),
        (
            "phone, a point of light",
            point(&centred, 1.0),
            centred,
            true,
        ),
        (
            "f/22, small pixels",
            card(&small_stop, 1.0, 1.0),
            small_stop,
            true,
        ),
        (
            "f/22, large pixels, faint texture",
            card(&wide, 1.0, 0.01),
            wide,
            false,
        ),
    ];
    let mut wrong = Vec::new();
    for (name, scene, camera, seen) in cases {
        let whole = Shot { camera, scene };
        let auto = planned(&whole, &Choice::Auto);
        let of_diffraction = |d: &&Decision| d.effect == Effect::LensDiffraction;
        let decision = auto.decisions.iter().find(of_diffraction).unwrap();
        let off = difference_percent(&whole, &auto.shot);
        let alone = difference_percent(&whole, &whole.without(Effect::LensDiffraction).unwrap());
        println!(
            "{name}: {decision}; without it {alone:.3} %, without all that is left out {off:.3} %"
        );
        if off >= Tolerance::default().signal_percent || decision.verdict.is_left_out() == seen {
            wrong.push(format!("{name}: {decision}, {off} %"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
