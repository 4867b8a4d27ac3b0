#![allow(clippy::unwrap_used)] // because tests fail by panicking

use std::path::Path;

use quadpixel::em::PixelStack;
use quadpixel::sensor::{Charge, CollectedAt, MicrolensLaw};

use super::{CameraFile, FittedCamera, LensPart};
use crate::assemble;
use crate::config::{DEFAULT_TOML, DatasetConfig, Draw, ReadoutConfig};
use crate::draw;
use crate::recipe::Recipe;

fn camera(folder: &Path) -> CameraFile {
    let pixel = PixelStack {
        subpixels: quadpixel::sensor::Subpixels::DUAL_X,
        ..PixelStack::builtin("1.6um").unwrap()
    };
    let camera = CameraFile {
        name: "a phone".into(),
        lens: LensPart {
            file: None,
            focal_length_mm: 4.4,
            f_number: 2.2,
        },
        charge: Charge {
            diffusion_um: 0.2,
            crosstalk: 0.1,
            collected_at: CollectedAt::LitSide,
        },
        left_over_right: 1.2,
        microlenses: MicrolensLaw {
            um: 0.1,
            um_per_mm: -0.05,
            ..MicrolensLaw::default()
        },
        pixel,
        parameters: Vec::new(),
    };
    std::fs::write(
        folder.join("camera.toml"),
        toml::to_string(&camera).unwrap(),
    )
    .unwrap();
    camera
}

#[test]
fn a_dataset_has_the_lens_the_microlenses_and_the_charge_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = camera(folder.path());
    let path = folder.path().join("camera.toml");
    let fitted = FittedCamera::read(&path).unwrap();
    assert_eq!(fitted.camera(), &file);
    assert_eq!(fitted.warnings.len(), 1, "{:?}", fitted.warnings);
    let mut config = DatasetConfig::from_toml(DEFAULT_TOML, "t").unwrap();
    config.readout = Some(ReadoutConfig {
        gain_mismatch: Draw::Fixed(0.0),
        ..ReadoutConfig::default()
    });
    fitted.put_into(&mut config);
    config.check().unwrap();
    // As it is kept beside a dataset, and read again.
    let kept = toml::to_string(&config).unwrap();
    assert_eq!(DatasetConfig::from_toml(&kept, "t").unwrap(), config);
    let pitch = |name: &str| Ok(assemble::pixel(name)?.pitch_um);
    let recipe = draw::recipe(&config, 0, &pitch).unwrap();
    assert_eq!(recipe.sensor.pitch_um, 1.6);
    let lens = assemble::lens(&recipe.lens).unwrap();
    let p = lens.paraxial(550.0).unwrap();
    assert!(
        (p.efl_mm - 4.4).abs() < 1e-6 && (p.f_number - 2.2).abs() < 1e-3,
        "{p:?}"
    );
    let gains = |recipe: &Recipe| recipe.readout.as_ref().unwrap().subpixel_gains.clone();
    let [left, right] = gains(&recipe)[..] else {
        panic!("{:?}", gains(&recipe))
    };
    assert!((left / right - 1.2).abs() < 1e-12 && (left + right - 2.0).abs() < 1e-12);
    // Another recipe takes the same camera.
    let mut other = recipe.clone();
    if let Some(readout) = &mut other.readout {
        readout.subpixel_gains = vec![1.1; 4];
    }
    other.lens.name = "lib_dgauss_50mm".into();
    fitted.put_into_recipe(&mut other);
    assert_eq!(
        (&other.lens.name, &other.response),
        (&recipe.lens.name, &recipe.response)
    );
    assert_eq!(other.sensor.microlens_law, file.microlenses);
    assert_eq!(gains(&other), gains(&recipe));
}

#[test]
fn a_lens_that_does_not_open_as_far_is_told_of_and_one_that_is_not_there_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = camera(folder.path());
    let path = folder.path().join("camera.toml");
    file.lens.f_number = 1.2;
    std::fs::write(&path, toml::to_string(&file).unwrap()).unwrap();
    let fitted = FittedCamera::read(&path).unwrap();
    assert_eq!(fitted.warnings.len(), 2, "{:?}", fitted.warnings);
    let mut config = DatasetConfig::from_toml(DEFAULT_TOML, "t").unwrap();
    fitted.put_into(&mut config);
    assert_eq!(config.lens.f_number, None);
    for (change, named) in [
        ("file = \"absent.zmx\"\nfocal", "absent.zmx"),
        ("focal_length = 3\nfocal", "focal_length"),
    ] {
        let text = toml::to_string(&file).unwrap();
        std::fs::write(&path, text.replacen("focal", change, 1)).unwrap();
        let why = FittedCamera::read(&path).unwrap_err().to_string();
        assert!(why.contains(named), "{why}");
    }
    file.charge.diffusion_um = -1.0;
    std::fs::write(&path, toml::to_string(&file).unwrap()).unwrap();
    let why = FittedCamera::read(&path).unwrap_err().to_string();
    assert!(why.contains("diffusion_um"), "{why}");
}

#[test]
fn numbers_that_no_camera_has_are_refused_by_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera.toml");
    let whole = camera(folder.path());
    for (change, said) in [
        (
            (|c| c.microlenses.axis_x_mm = 1e200) as fn(&mut CameraFile),
            "microlenses.axis_x_mm",
        ),
        (|c| c.microlenses.um = 1000.0, "microlenses.um"),
        (
            |c| c.microlenses.um_per_mm5 = f64::NAN,
            "microlenses.um_per_mm5",
        ),
        (|c| c.charge.diffusion_um = 1e300, "charge.diffusion_um"),
        (|c| c.charge.crosstalk = 0.6, "charge.crosstalk"),
        (|c| c.lens.f_number = 1000.0, "lens.f_number is 1000"),
        (|c| c.pixel.pitch_um = 0.0, "pixel.pitch_um is 0"),
    ] {
        let mut bad = whole.clone();
        change(&mut bad);
        std::fs::write(&path, toml::to_string(&bad).unwrap()).unwrap();
        let refused = FittedCamera::read(&path).map(|_| ()).unwrap_err();
        assert!(refused.to_string().contains(said), "{refused}");
    }
}
