//! The list of the statements that can be checked numerically: those of the paper, and those on forces, impacts and
//! graphs of flows.

use std::fmt;

/// The entries of the list for a statement, besides its name and number.
struct Row {
    section: &'static str,
    title: &'static str,
    text: &'static str,
}

/// Defines [`Statement`] from the list. The sentence above a variant is both its documentation and its text; its
/// number, the section of the paper and its title follow.
macro_rules! statements {
    ($(#[doc = $text:literal] $name:ident = $number:literal, $section:literal, $title:literal;)*) => {
        /// A statement of the paper *On the geometry of discrete contact mechanics*, with its errata applied; or one on
        /// forces, impacts or graphs of flows, which the paper does not treat, in the sections `forces`, `impacts` and
        /// `legendrian`.
        ///
        /// The number is that of its rows in `statements.csv`; its tests are in `tests/motions/paper`. Most statements are
        /// evaluated by the function `residual` in the module `statements` of a library.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Statement {
            $(#[doc = $text] $name = $number,)*
        }

        impl Statement {
            /// All statements, in the order of their numbers.
            pub const ALL: [Statement; 48] = [$(Statement::$name),*];

            fn row(self) -> Row {
                match self {
                    $(Statement::$name => Row { section: $section, title: $title, text: $text },)*
                }
            }
        }
    };
}

statements! {
    /// The volume eta ^ (d eta)^n vanishes nowhere on T*Q x R, and on TQ x R and Q x Q x R for a regular L or L_d.
    Volume = 1, "2.1", "contact condition";
    /// The Reeb field R, in Darboux coordinates d/dz, has i_R d eta = 0, eta(R) = 1, flat(R) = eta; flat is invertible.
    ReebField = 2, "2.1", "Reeb field, flat and sharp";
    /// The field X_f of a function f is the one with flat(X_f) = df - (f + R(f)) eta, and f = -eta(X_f).
    HamiltonianField = 3, "2.1", "contact Hamiltonian vector field";
    /// A field X has L_X eta = a eta exactly if it is X_f for some f, with a = -R(f); it keeps eta where R(f) = 0.
    InfinitesimalContactomorphism = 4, "2.1", "L_X eta = -R(f) eta";
    /// The flow of X_H multiplies eta by sigma_t = exp(int a), where the rate a = -R(H) is integrated along the motion.
    ConformalFactor = 5, "2.1", "conformal factor of a flow";
    /// A Hamiltonian is dissipated along its own field: X_H(H) = -R(H) H.
    EnergyDecay = 6, "2.1", "X_H(H) = -R(H) H";
    /// L is regular exactly if eta_L is a contact form, and then its Reeb field is d/dz - W^-1 L_vz d/dv.
    Regularity = 7, "2.2", "L regular iff eta_L contact";
    /// The Herglotz field xi_L, that of the energy E_L, is of second order, and its motions solve Herglotz' equations.
    HerglotzField = 8, "2.2", "Herglotz field is of second order";
    /// The Legendre transformation FL is a local contactomorphism that takes E_L to H and xi_L to X_H.
    LegendreTransformation = 9, "2.2", "FL is a contactomorphism";
    /// A curve with fixed ends has a critical action exactly if it solves Herglotz' equations; dZ/dz0 = exp(int L_z).
    HerglotzPrinciple = 10, "2.2.1", "Herglotz' principle";
    /// A function f is dissipated, X_H(f) = -R(H) f, exactly if f o phi_t = sigma_t f; quotients of two are conserved.
    DissipatedQuantities = 11, "2.2.2", "dissipated quantities";
    /// Where L is invariant, the lifted action is by contactomorphisms of eta_L, and its momentum is dissipated.
    Noether = 12, "2.2.2", "Noether's theorem";
    /// A path and z_0 give every z_k, and the differential of the action of any number of steps has the stated formula.
    ActionDifferential = 13, "3", "differential of the discrete action";
    /// The differential of the discrete action of two steps is the one that the remark writes out.
    TwoSteps = 14, "3", "differential of the action of two steps";
    /// Where sigma_d is not zero, a path has a critical action exactly if it solves the discrete Herglotz equations.
    DiscreteHerglotzPrinciple = 15, "3", "discrete Herglotz principle";
    /// The condition of Vermeeren, Bravetti and Seri on Q x Q x R^2 is equivalent to the discrete Herglotz equations.
    VermeerenBravettiSeri = 16, "3", "condition on Q x Q x R^2";
    /// The transform F+L_d is a local diffeomorphism exactly if F-L_d is one.
    DiscreteRegularity = 17, "3.1", "F+ regular iff F- regular";
    /// The states F+L_d(q0, q1, z0) and F-L_d(q1, q2, z1) are equal exactly if the discrete Herglotz equations hold.
    MomentumMatching = 18, "3.1", "momentum matching";
    /// The flow Phi_d, F+L_d and then the inverse of F-L_d, exists exactly if F-L_d is a local diffeomorphism.
    DiscreteFlowExists = 19, "3.1", "existence of the discrete flow";
    /// The three expressions of the discrete Hamiltonian flow are equal, and its diagram commutes.
    HamiltonianFlowExpressions = 20, "3.1", "three expressions of the flow";
    /// The pullbacks eta+ and eta- of eta are contact forms, with the stated local expressions.
    DiscreteContactForms = 21, "3.1", "eta+ and eta- are contact forms";
    /// The forms eta+ and eta- are conformal, eta+ = sigma_d eta-, and Phi_d pulls eta- back to eta+.
    DiscreteFormsAreConformal = 22, "3.1", "eta+ = sigma_d eta-, pullback to eta+";
    /// The flow Phi_d pulls eta- back to sigma_d eta-, and eta+ to (sigma_d o Phi_d) eta+.
    DiscreteFlowIsConformal = 23, "3.1", "conformal factors of Phi_d";
    /// The discrete Hamiltonian flow pulls eta back to sigma_d eta, with sigma_d at the step that begins in the state.
    HamiltonianFlowIsConformal = 24, "3.1", "conformal factor of the flow on T*Q x R";
    /// Where L_d is invariant, D1 L_d xi(q0) + D2 L_d xi(q1) = 0 for each generator xi.
    DiscreteInvariance = 25, "3.2", "invariance of L_d";
    /// Where L_d is invariant, the lifted action keeps eta+ and eta-, and the momentum obeys J_d o Phi_d = sigma_d J_d.
    DiscreteNoether = 26, "3.2", "discrete Noether theorem";
    /// The multiplier of Chetaev's principle is -L_z, so that the non-holonomic system has Herglotz' equations.
    ChetaevMultiplier = 27, "4.1", "Chetaev's multiplier";
    /// The projection pi takes the non-holonomic field Gamma to xi_L, and the flow of the one to that of the other.
    ProjectedFlow = 28, "4.1", "flow of the non-holonomic system";
    /// The contact exponential map exp_h is a local diffeomorphism except at conjugate points.
    ExponentialMap = 29, "4.1", "exp_h is a local diffeomorphism";
    /// The contact exponential map is the inverse of pi on M_L, then the non-holonomic one, then the projection of M_d.
    NonHolonomicExponential = 30, "4.1", "the two exponential maps";
    /// The projection of M_d, the image of the non-holonomic exponential map, to Q x Q x R is a local diffeomorphism.
    ImageProjection = 31, "4.1", "projection of M_d";
    /// The retraction to the start of a motion inverts exp_h, and the one to its end is the flow phi_h after it.
    ExactRetractions = 32, "4.1", "exact retractions";
    /// The linear equation of the variation of z has the stated solution, and L_h^e = z(h) - z(0).
    LinearEquation = 33, "4.2", "linear equation of the action";
    /// The derivatives of L_h^e are D1 = -p0 e^b, D2 = p1 and Dz = e^b - 1, where b is the integral of L_z.
    ExactDerivatives = 34, "4.2", "D1, D2, Dz of L_h^e";
    /// The discrete Legendre transforms of L_h^e are FL after the exact retractions.
    ExactLegendreTransforms = 35, "4.2", "F(+-)L_h^e = FL o R_h^(e+-)";
    /// L_h^e is regular, its F+ is its F- and then the flow of X_H, and its discrete motions sample the true ones.
    ExactFlow = 36, "4.2", "F+L_h^e = phi_h o F-L_h^e, motion";
    /// The free particle's discrete equations have an explicit q2, and its L_h^e a closed form.
    FreeParticle = 37, "5", "free particle, explicit";
    /// The oscillator's discrete equations have an explicit q2, and its exact motion a closed form.
    HarmonicOscillator = 38, "5", "oscillator, explicit";
    /// The midpoint rule has the stated equations for any potential V, with sigma_d positive where h is small.
    MidpointRule = 39, "5", "midpoint rule for any V";
    /// The error L_d - L_h^e has the order of the method: h^(r+1) in value and flow, h^r in the Legendre transforms.
    ErrorOrders = 40, "6", "orders of L_d - L_h^e and of the flow";
    /// Rules on Q x Q x R^2, also those of higher order, are discrete Lagrangians on Q x Q x R with the same momenta.
    ExtendedRules = 41, "6", "rules on Q x Q x R^2";
    /// With a force f, which does no work in z' = L, the energy changes as E' = L_z E - L_t + f.v.
    ForcedEnergy = 42, "forces", "energy with a force";
    /// With discrete forces F- and F+ the flow pulls eta back to sigma_d eta - F-.dq0 - F+.dq1.
    DiscreteForces = 43, "forces", "contact defect of discrete forces";
    /// The contact defect of a Gauss step is the virtual work of the force, the sum of -h b_j rho_j f_j.dQ_j.
    VirtualWork = 44, "forces", "contact defect of a Gauss step";
    /// A momentum obeys J1 = sigma_d J0 plus the impulse of the force on the group; it decays exactly where f.xi = 0.
    ForcedMomentum = 45, "forces", "momentum with a force";
    /// An elastic impact is strictly contact: dz - p dq + H dt has the same values on the surface before and after it.
    ElasticImpact = 46, "impacts", "elastic impacts are strictly contact";
    /// The law p+ = c p- + mu g_q, z+ = c z-, H+ = c H- - mu g_t multiplies dz - p dq + H dt on the surface by c.
    ConformalImpact = 47, "impacts", "conformally contact impacts";
    /// The graph of a flow phi_h at r = ln sigma_h is Legendrian in (M x M x R, eta1 - e^r eta0), M = T*Q x R.
    LegendrianGraph = 48, "legendrian", "Legendrian graph of a flow";
}

impl Statement {
    /// The statement's number in the project's list, from 1 to 48.
    pub fn number(self) -> u32 {
        self as u32
    }

    /// The statement with a given number; `None` if the list has no such number.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|statement| statement.number() == number)
    }

    /// A short title, for tables.
    pub fn title(self) -> &'static str {
        self.row().title
    }

    /// The statement in one sentence.
    pub fn text(self) -> &'static str {
        // The text of a doc comment begins with a space.
        self.row().text.trim_start()
    }

    /// The section of the paper that contains the statement, such as `2.2.1`; `forces`, `impacts` and `legendrian` for
    /// those that the paper does not contain.
    pub fn section(self) -> &'static str {
        self.row().section
    }
}

/// Number and title.
impl fmt::Display for Statement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.number(), self.title())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn numbers_are_places() {
        assert!(Statement::ALL.into_iter().map(Statement::number).eq(1..=48));
        for statement in Statement::ALL {
            assert_eq!(Statement::from_number(statement.number()), Some(statement));
        }
        assert_eq!([0, 49, u32::MAX].map(Statement::from_number), [None; 3]);
    }

    #[test]
    fn words_are_its_own() {
        let different = |of: fn(Statement) -> &'static str| BTreeSet::from(Statement::ALL.map(of)).len();
        assert_eq!([different(Statement::title), different(Statement::text)], [Statement::ALL.len(); 2]);
        for statement in Statement::ALL {
            let text = statement.text();
            assert!(text.starts_with(char::is_uppercase) && text.ends_with('.'), "{statement}: {text}");
        }
    }

    #[test]
    fn they_follow_the_sections() {
        assert!(Statement::ALL.is_sorted_by_key(|statement| statement.section()));
    }

    #[test]
    fn it_is_shown_by_number_and_title() {
        assert_eq!(Statement::EnergyDecay.to_string(), "6 (X_H(H) = -R(H) H)");
    }
}
