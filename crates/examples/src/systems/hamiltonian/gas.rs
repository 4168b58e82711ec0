//! Ideal gases and gases of van der Waals.

use contact_geom::Scalar;

/// A gas of van der Waals with `N k_B = 1`: the energy `U(V, S) = u - a/V` with the thermal part
/// `u = u0 (V - b)^(-1/c) e^(S/c)`, the temperature `T = U_S = u/c` and the pressure `P = -U_V = T/(V - b) - a/V^2`.
/// It is ideal for `a = b = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gas {
    /// The attraction a between the particles.
    pub attraction: f64,
    /// The volume b of the particles.
    pub covolume: f64,
    /// The heat capacity c at constant volume, 3/2 for a gas of atoms.
    pub heat_capacity: f64,
    /// The thermal energy u0 at `V - b = 1`, `S = 0`.
    pub reference: f64,
}

impl Gas {
    /// An ideal gas of atoms, with the energy 2 at the volume 1 and the entropy 0.
    pub fn ideal() -> Self {
        Gas { attraction: 0.0, covolume: 0.0, heat_capacity: 1.5, reference: 2.0 }
    }

    /// A gas of van der Waals, with the thermal energy of [`ideal`](Self::ideal).
    pub fn van_der_waals(attraction: f64, covolume: f64) -> Self {
        Gas { attraction, covolume, ..Self::ideal() }
    }

    /// The energy at a volume above b and an entropy.
    #[inline(always)]
    pub fn energy<T: Scalar>(&self, volume: T, entropy: T) -> T {
        self.temperature(volume, entropy) * self.heat_capacity - volume.recip() * self.attraction
    }

    /// The temperature at a volume above b and an entropy.
    #[inline(always)]
    pub fn temperature<T: Scalar>(&self, volume: T, entropy: T) -> T {
        let exponent = (entropy - (volume - self.covolume).ln()) / self.heat_capacity;
        exponent.exp() * (self.reference / self.heat_capacity)
    }

    /// The temperature at a volume and an energy.
    #[inline(always)]
    pub fn temperature_of_energy<T: Scalar>(&self, volume: T, energy: T) -> T {
        (energy + volume.recip() * self.attraction) / self.heat_capacity
    }

    /// The pressure at a volume above b and a temperature.
    #[inline(always)]
    pub fn pressure<T: Scalar>(&self, volume: T, temperature: T) -> T {
        temperature / (volume - self.covolume) - (volume * volume).recip() * self.attraction
    }

    /// The entropy at a volume above b and a positive temperature.
    #[inline(always)]
    pub fn entropy<T: Scalar>(&self, volume: T, temperature: T) -> T {
        (temperature * (self.heat_capacity / self.reference)).ln() * self.heat_capacity + (volume - self.covolume).ln()
    }
}
