//! Many rays as columns.

use glam::DVec3;

use crate::lens::system::{Ray, RayFailure};

/// Values of [`RayBatch::status`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum RayStatus {
    /// The ray is alive.
    Ok = 0,
    /// [`RayFailure::Missed`].
    Missed = 1,
    /// [`RayFailure::Vignetted`].
    Vignetted = 2,
    /// [`RayFailure::TotalInternalReflection`].
    TotalInternalReflection = 3,
}

/// Rays in the camera frame as columns: origin (mm), unit direction, and what became of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RayBatch {
    /// x of the origin, mm.
    pub ox: Vec<f64>,
    /// y of the origin, mm.
    pub oy: Vec<f64>,
    /// z of the origin, mm.
    pub oz: Vec<f64>,
    /// x of the unit direction.
    pub dx: Vec<f64>,
    /// y of the unit direction.
    pub dy: Vec<f64>,
    /// z of the unit direction.
    pub dz: Vec<f64>,
    /// 0 for a ray that is alive, else the reason as in [`RayStatus`].
    pub status: Vec<u8>,
    /// Index of the surface at which a lost ray was lost; meaningless while `status` is 0.
    pub surface: Vec<u16>,
}

impl RayBatch {
    /// An empty batch with room for `rays`.
    pub fn with_capacity(rays: usize) -> RayBatch {
        let column = || Vec::with_capacity(rays);
        RayBatch {
            ox: column(),
            oy: column(),
            oz: column(),
            dx: column(),
            dy: column(),
            dz: column(),
            status: Vec::with_capacity(rays),
            surface: Vec::with_capacity(rays),
        }
    }

    /// Number of rays. Columns filled by hand to different lengths count up to the shortest.
    pub fn len(&self) -> usize {
        [&self.oy, &self.oz, &self.dx, &self.dy, &self.dz]
            .iter()
            .fold(self.ox.len(), |n, column| n.min(column.len()))
            .min(self.status.len())
            .min(self.surface.len())
    }

    /// Whether there is no ray.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Removes all rays and keeps the memory.
    pub fn clear(&mut self) {
        for column in [
            &mut self.ox,
            &mut self.oy,
            &mut self.oz,
            &mut self.dx,
            &mut self.dy,
            &mut self.dz,
        ] {
            column.clear();
        }
        self.status.clear();
        self.surface.clear();
    }

    /// Appends a ray that is alive.
    pub fn push(&mut self, ray: Ray) {
        self.ox.push(ray.origin_mm.x);
        self.oy.push(ray.origin_mm.y);
        self.oz.push(ray.origin_mm.z);
        self.dx.push(ray.direction.x);
        self.dy.push(ray.direction.y);
        self.dz.push(ray.direction.z);
        self.status.push(RayStatus::Ok as u8);
        self.surface.push(0);
    }

    /// Ray `i`; `None` past the end.
    ///
    /// # Errors
    /// (inside) where ray `i` was lost, and why.
    pub fn get(&self, i: usize) -> Option<Result<Ray, RayFailure>> {
        if i >= self.len() {
            return None;
        }
        let surface = usize::from(self.surface[i]);
        Some(match self.status[i] {
            0 => Ok(Ray {
                origin_mm: DVec3::new(self.ox[i], self.oy[i], self.oz[i]),
                direction: DVec3::new(self.dx[i], self.dy[i], self.dz[i]),
            }),
            1 => Err(RayFailure::Missed { surface }),
            2 => Err(RayFailure::Vignetted { surface }),
            _ => Err(RayFailure::TotalInternalReflection { surface }),
        })
    }
}
