//! Rays: what the lens hands to the scene, and the scene is asked about.
//!
//! Camera frame (see [`crate::frames`]): origins in mm, unit directions. One ray is a [`Ray`]; many are columns, owned
//! by a [`RayBatch`] and lent as [`RaySlices`]. A ray that the lens loses is a value, with its reason: a
//! [`RayFailure`].

use glam::DVec3;

/// A ray in the camera frame: `origin_mm`, unit `direction`. Light travels along +z when traced forward; traced
/// backward from the sensor, `direction.z < 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// A point on the ray, mm.
    pub origin_mm: DVec3,
    /// Unit direction.
    pub direction: DVec3,
}

/// Why a ray was lost, with the index of the surface in
/// [`OpticalSystem::surfaces`](crate::lens::OpticalSystem::surfaces).
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RayFailure {
    /// The ray does not meet the surface.
    #[error("the ray misses surface {surface}")]
    Missed {
        /// Index of the surface.
        surface: usize,
    },
    /// The ray meets the surface outside its clear aperture, or the stop.
    #[error("the ray is stopped by the aperture of surface {surface}")]
    Vignetted {
        /// Index of the surface.
        surface: usize,
    },
    /// The ray is totally reflected at a refracting surface.
    #[error("the ray is totally reflected at surface {surface}")]
    TotalInternalReflection {
        /// Index of the surface.
        surface: usize,
    },
}

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
    /// Written by tracing: 0 for a ray that is alive, else the reason as in [`RayStatus`].
    pub status: Vec<u8>,
    /// Written by tracing: index of the surface at which a lost ray was lost; 0 while `status` is 0.
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

    /// Number of rays. Columns of origins and directions filled by hand to different lengths count up to the shortest.
    pub fn len(&self) -> usize {
        [&self.oy, &self.oz, &self.dx, &self.dy, &self.dz]
            .iter()
            .fold(self.ox.len(), |n, column| n.min(column.len()))
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

    /// Appends a ray from `origin_mm` along the unit vector `direction`.
    pub fn push(&mut self, origin_mm: DVec3, direction: DVec3) {
        self.ox.push(origin_mm.x);
        self.oy.push(origin_mm.y);
        self.oz.push(origin_mm.z);
        self.dx.push(direction.x);
        self.dy.push(direction.y);
        self.dz.push(direction.z);
        self.status.push(RayStatus::Ok as u8);
        self.surface.push(0);
    }

    /// Origin and direction of ray `i` as they stand: the traced ray if it is alive, else the one that came in. `i` is
    /// below [`RayBatch::len`].
    pub fn ray(&self, i: usize) -> Ray {
        Ray {
            origin_mm: DVec3::new(self.ox[i], self.oy[i], self.oz[i]),
            direction: DVec3::new(self.dx[i], self.dy[i], self.dz[i]),
        }
    }

    /// Why ray `i` was lost; `None` if it is alive or was not traced.
    pub fn failure(&self, i: usize) -> Option<RayFailure> {
        let surface = usize::from(*self.surface.get(i)?);
        match *self.status.get(i)? {
            0 => None,
            1 => Some(RayFailure::Missed { surface }),
            2 => Some(RayFailure::Vignetted { surface }),
            _ => Some(RayFailure::TotalInternalReflection { surface }),
        }
    }

    /// What came of ray `i`, which is below [`RayBatch::len`].
    ///
    /// # Errors
    /// Where it was lost, and why.
    pub fn get(&self, i: usize) -> Result<Ray, RayFailure> {
        self.failure(i).map_or_else(|| Ok(self.ray(i)), Err)
    }
}

/// Origins and unit directions of a batch of rays in the camera frame, as slices of equal length.
#[derive(Clone, Copy, Debug)]
pub struct RaySlices<'a> {
    /// Origin, mm.
    pub origin_mm: [&'a [f64]; 3],
    /// Unit direction, away from the camera.
    pub direction: [&'a [f64]; 3],
    /// 0 for a ray that is alive. What a lost one meets has no meaning.
    pub status: &'a [u8],
}

impl<'a> RaySlices<'a> {
    /// The rays of a batch as they stand.
    pub fn from_batch(batch: &'a RayBatch) -> Self {
        Self {
            origin_mm: [&batch.ox, &batch.oy, &batch.oz],
            direction: [&batch.dx, &batch.dy, &batch.dz],
            status: &batch.status,
        }
    }

    /// Each ray that is alive, with its number in the batch.
    pub fn alive(self) -> impl Iterator<Item = (usize, Ray)> + 'a {
        let [ox, oy, oz] = self.origin_mm;
        let [dx, dy, dz] = self.direction;
        let is_alive = move |i: &usize| self.status[*i] == 0;
        (0..ox.len()).filter(is_alive).map(move |i| {
            let origin_mm = DVec3::new(ox[i], oy[i], oz[i]);
            let direction = DVec3::new(dx[i], dy[i], dz[i]);
            (
                i,
                Ray {
                    origin_mm,
                    direction,
                },
            )
        })
    }
}
