//! What is rendered, and the same without one effect.

use super::Effect;
use crate::render::Camera;
use crate::scene::Scene;
use crate::scene::world::PathSettings;

/// A camera and what it looks at.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The camera.
    pub camera: Camera,
    /// The scene.
    pub scene: Scene,
}

impl Shot {
    /// The same without an effect, by the renderer's cheaper path; `None` where the effect is not there, or has no such
    /// path.
    pub fn without(&self, effect: Effect) -> Option<Self> {
        let with_camera = |camera| Self {
            camera,
            scene: self.scene.clone(),
        };
        match effect {
            Effect::PixelDiffraction => self.camera.without_pixel_diffraction().map(with_camera),
            Effect::LensDiffraction => self.camera.without_lens_diffraction().map(with_camera),
            Effect::LensReflections => self.camera.without_reflections().map(with_camera),
            Effect::CraVariation => self.camera.without_chief_ray_variation().map(with_camera),
            Effect::Wavelengths => self.camera.without_band_width().map(with_camera),
            Effect::Dispersion => self.camera.without_dispersion().map(with_camera),
            Effect::Aberrations => self.camera.without_aberrations().map(with_camera),
            Effect::GlobalIllumination => self.in_direct_light(),
            // The others have no cheaper path.
            _ => None,
        }
    }

    /// Whether the effect is there at all.
    pub(super) fn has(&self, effect: Effect) -> bool {
        match effect {
            Effect::Vignetting => self.camera.is_real_lens(),
            Effect::Occlusion => self.scene.planes().len() > 1 || self.scene.world().is_some(),
            Effect::Noise => false,
            other => self.without(other).is_some(),
        }
    }

    fn in_direct_light(&self) -> Option<Self> {
        let (world, paths) = self.scene.world()?;
        let direct = PathSettings {
            max_bounces: 1,
            ..*paths
        };
        (paths.max_bounces > 1).then(|| Self {
            camera: self.camera.clone(),
            scene: Scene::from_world(world.clone(), direct),
        })
    }
}
