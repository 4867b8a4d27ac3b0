//! (room of the render stage)
