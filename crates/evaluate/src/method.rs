//! The methods that are compared in one table.

use serde::{Deserialize, Serialize};

/// A way to predict soft tissue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Damped springs per region, tuned on the training set: what avatars on the web have today.
    SpringBones,
    /// Principal components and a linear second-order auto-regression (Dyna, Pons-Moll et al. 2015;
    /// DMPL, Loper et al. 2015).
    Dmpl,
    /// Casas & Otaduy 2018, with the loss that weighs vertices by their rigidity (Eqs. 6-7).
    CasasOtaduy,
    /// The same without those weights.
    CasasOtaduyUnweighted,
    /// DSNet (Seo, Zou, Cordier 2021): shape enters at every step.
    Dsnet,
    /// Its variant whose radial basis functions set the LSTM's first state from the shape.
    DsnetRbf,
    /// Ours.
    Dynaskin,
}

impl Method {
    /// All of them, in the order of the table.
    pub const ALL: [Self; 7] = [
        Self::SpringBones,
        Self::Dmpl,
        Self::CasasOtaduy,
        Self::CasasOtaduyUnweighted,
        Self::Dsnet,
        Self::DsnetRbf,
        Self::Dynaskin,
    ];

    /// Name in commands and folders: `casas-otaduy-unweighted`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SpringBones => "spring-bones",
            Self::Dmpl => "dmpl",
            Self::CasasOtaduy => "casas-otaduy",
            Self::CasasOtaduyUnweighted => "casas-otaduy-unweighted",
            Self::Dsnet => "dsnet",
            Self::DsnetRbf => "dsnet-rbf",
            Self::Dynaskin => "dynaskin",
        }
    }

    /// Name in reports.
    pub const fn label(self) -> &'static str {
        match self {
            Self::SpringBones => "spring bones",
            Self::Dmpl => "Dyna / DMPL",
            Self::CasasOtaduy => "Casas-Otaduy",
            Self::CasasOtaduyUnweighted => "Casas-Otaduy, unweighted",
            Self::Dsnet => "DSNet",
            Self::DsnetRbf => "DSNet, RBF",
            Self::Dynaskin => "dynaskin",
        }
    }

    /// The method called `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_serialised_form() {
        for method in Method::ALL {
            let json = serde_json::to_value(method).expect("a name");
            assert_eq!(json, method.name());
            assert_eq!(Method::from_name(method.name()), Some(method));
        }
    }
}
