//! Where each pixel of a warped image comes from.

/// Positions in the source image, one per pixel of the result.
///
/// f64, because f32 has only 0.0002 px left at column 4000.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    width: usize,
    height: usize,
    x: Vec<f64>,
    y: Vec<f64>,
}

/// A map whose parts do not fit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("map: {x} columns and {y} rows of positions are not {width} × {height}, at least 1 × 1")]
pub struct MapError {
    width: usize,
    height: usize,
    x: usize,
    y: usize,
}

impl Map {
    /// Source column `x` and row `y` in px of each pixel, row-major; NaN where there is none.
    ///
    /// # Errors
    /// No pixel, or positions that are not as many as pixels.
    pub fn new(width: usize, height: usize, x: Vec<f64>, y: Vec<f64>) -> Result<Self, MapError> {
        let fits = width >= 1 && height >= 1 && x.len() == width * height && y.len() == x.len();
        if !fits {
            return Err(MapError {
                width,
                height,
                x: x.len(),
                y: y.len(),
            });
        }
        Ok(Self {
            width,
            height,
            x,
            y,
        })
    }

    /// The position of each pixel by its column and row.
    ///
    /// # Errors
    /// No pixel.
    pub fn from_fn(
        width: usize,
        height: usize,
        position: impl Fn(usize, usize) -> (f64, f64),
    ) -> Result<Self, MapError> {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let (x, y) = pixels.map(|(x, y)| position(x, y)).unzip();
        Self::new(width, height, x, y)
    }

    /// out(x, y) = image(x + `dx_px`, y + `dy_px`).
    ///
    /// # Errors
    /// No pixel.
    pub fn shift(width: usize, height: usize, dx_px: f64, dy_px: f64) -> Result<Self, MapError> {
        Self::from_fn(width, height, |x, y| (x as f64 + dx_px, y as f64 + dy_px))
    }

    /// Columns of the result.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Rows of the result.
    pub fn height(&self) -> usize {
        self.height
    }
    /// Positions (x, y) of a row of the result.
    pub fn row(&self, row: usize) -> (&[f64], &[f64]) {
        let range = row * self.width..(row + 1) * self.width;
        (&self.x[range.clone()], &self.y[range])
    }
}
