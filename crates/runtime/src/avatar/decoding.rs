//! Who decodes: the step, or a host that draws with what the decoder is given.

use std::sync::Arc;

use glam::Vec3;

use super::Avatar;

/// When an avatar's latents become offsets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Decoding {
    /// In every step that changes the surface.
    #[default]
    InStep,
    /// When [`Avatar::update_surface`] asks for it: for hosts that decode on a graphics card
    /// ([`Avatar::undecoded_latents`]). Where that cannot be, steps decode as usual: without a
    /// [`crate::Model::linear_decoder`], with a stiffness or damping that the networks have not learned
    /// (and until what fades then has faded), and with [`Avatar::set_max_strain`].
    OnDemand,
}

impl Avatar {
    /// When latents become offsets.
    pub fn decoding(&self) -> Decoding {
        self.decoding
    }

    /// Changes that; what is shown stays the same. Not part of a saved state.
    pub fn set_decoding(&mut self, decoding: Decoding) {
        self.decoding = decoding;
        self.choose_form();
    }

    /// What the decoder's matrix ([`crate::Model::linear_decoder`]) makes offsets of, with everything that
    /// fades; gains and limits come after. At rest all are 0. None while steps decode: then the surface is
    /// what it is without [`Decoding::OnDemand`].
    pub fn undecoded_latents(&self) -> Option<&[f32]> {
        self.soft.as_ref()?.tissue.shown_latents()
    }

    /// Changes whenever the surface may have changed, decoded or not.
    pub fn surface_revision(&self) -> u32 {
        self.surface_revision
    }

    /// Changes with [`Self::vertex_gains`] and [`Self::vertex_limits_m`].
    pub fn controls_revision(&self) -> u32 {
        self.controls_revision
    }

    /// The factor on the offset of each of the model's soft vertices; empty without networks.
    pub fn vertex_gains(&self) -> &[f32] {
        let soft = self.soft.as_ref();
        soft.map_or(&[], |soft| &soft.vertex_controls.gains)
    }

    /// The longest offset of each of the model's soft vertices, in metres: half of it stays as it is, more
    /// approaches it smoothly. Empty without networks.
    pub fn vertex_limits_m(&self) -> &[f32] {
        let soft = self.soft.as_ref();
        soft.map_or(&[], |soft| &soft.vertex_controls.limits_m)
    }

    /// Positions of all vertices of the shape without offsets, in metres. They change with
    /// [`Self::revision`].
    pub fn still_positions_rest_m(&self) -> &[Vec3] {
        &self.shaped.surface.positions_m
    }

    /// Decodes what was left undecoded ([`Decoding::OnDemand`]), so that offsets, positions and normals are
    /// those of the last step. Costs what a step saved, and nothing where nothing is left.
    pub fn update_surface(&mut self) {
        if !std::mem::take(&mut self.is_behind) {
            return;
        }
        let (Some(soft), Some(decoder)) = (&self.soft, self.model.linear_decoder()) else {
            return;
        };
        let [offsets_m, _] = soft.tissue.in_metres(Some(decoder));
        self.surface.apply(
            self.model.topology(),
            &self.shaped.surface,
            &offsets_m,
            &soft.vertex_controls,
        );
    }

    /// Lets the tissue keep latents or offsets, as decoding, and what else is asked for, allows.
    pub(super) fn choose_form(&mut self) {
        let model = Arc::clone(&self.model);
        let Some(soft) = &mut self.soft else {
            return;
        };
        let keeps = self.decoding == Decoding::OnDemand && self.max_strain.is_none();
        if keeps && model.linear_decoder().is_some() {
            soft.tissue.keep_latents();
        } else {
            soft.tissue.keep_offsets(|| model.linear_decoder());
        }
        if self.is_behind && self.undecoded_latents().is_none() {
            self.apply();
        }
    }
}
