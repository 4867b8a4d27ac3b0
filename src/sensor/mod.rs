//! (room of the sensor stage)
