//! How a block of contacts is evaluated: tile by tile, with the loops of its law.

use concordem_contact::kinematics::deformable::ParticleVirial;
use rayon::prelude::*;

use super::{LawLoops, Tile};
use crate::evaluation::{ContactForces, EvaluatedContacts, ParticleSums, StepContext, TileMap, Totals, WallForces};
use crate::state::Wall;
use crate::state::contacts::{ContactBlock, Contacts, Pair};

impl<L: LawLoops> EvaluatedContacts for ContactBlock<L> {
    fn evaluate(&mut self, context: &StepContext<'_>, map: &mut TileMap, sums: ParticleSums<'_>) -> Totals {
        let (rows, tiles) = tiles(self, map, sums);
        let totals: Vec<Totals> = tiles.into_par_iter().map(|tile| L::evaluate_tile(context, rows, tile)).collect();
        let mut sum = Totals::default();
        for of_tile in totals {
            sum.merge(of_tile);
        }
        sum
    }
    fn evaluate_walls(&mut self, context: &StepContext<'_>, walls: &mut [Wall], sums: ParticleSums<'_>) -> Totals {
        L::evaluate_walls(self, context, walls, sums, None)
    }
    fn record(&self, context: &StepContext<'_>, border: Option<&[bool]>, out: &mut ContactForces) {
        // In pieces, because the records of all contacts take as much memory as the contacts.
        const PIECE: usize = 1 << 16;
        if let Some(member) = border {
            let crosses = |pair: &Pair| member[pair.a as usize] != member[pair.b as usize];
            let contacts = self.pair.iter().enumerate().filter(|(_, pair)| crosses(pair));
            let contacts: Vec<_> = contacts.map(|(k, _)| L::record_contact(self, k, context)).collect();
            out.extend(&contacts);
            out.end_block();
            return;
        }
        out.reserve(self.len());
        for start in (0..self.len()).step_by(PIECE) {
            let piece = start..self.len().min(start + PIECE);
            let contacts: Vec<_> = piece.into_par_iter().map(|k| L::record_contact(self, k, context)).collect();
            out.extend(&contacts);
        }
        out.end_block();
    }
    fn record_walls(&self, context: &StepContext<'_>, walls: &[Wall], out: &mut WallForces) {
        super::record::record_walls(self, context, walls, out);
    }
    fn boxed_clone(&self) -> Box<dyn EvaluatedContacts> {
        Box::new(self.clone())
    }
    fn contacts(&self) -> &dyn Contacts {
        self
    }
    fn contacts_mut(&mut self) -> &mut dyn Contacts {
        self
    }
}

/// The pair coefficients of a block, and its contacts cut into tiles together with the particles and halo slots they
/// write.
fn tiles<'a, L: LawLoops>(
    block: &'a mut ContactBlock<L>,
    map: &'a mut TileMap,
    sums: ParticleSums<'a>,
) -> (&'a [L], Vec<Tile<'a, L>>) {
    let ParticleSums { net, mut virials } = sums;
    if !virials.virials.is_empty() {
        map.virial_halo.resize(map.halo.len(), ParticleVirial::default());
    }
    let mut tiles = Vec::with_capacity(map.contact_start.len());
    let mut pair = &block.pair[..];
    let mut flags = &mut block.flags[..];
    let mut reference = block.reference.rows_mut();
    let mut previous = block.previous.rows_mut();
    let mut history = block.history.rows_mut();
    let mut rest_length = &block.rest_length[..];
    let mut strength = &map.strength[..];
    let mut halo = &mut map.halo[..];
    let mut virial_halo = &mut map.virial_halo[..];
    let length = map.tile_length;
    for (t, net) in net.chunks_mut(length).enumerate() {
        let contacts = (map.contact_start[t + 1] - map.contact_start[t]) as usize;
        let slots = (map.halo_start[t + 1] - map.halo_start[t]) as usize;
        tiles.push(Tile {
            base: t * length,
            length,
            pair: pair.split_off(..contacts).unwrap_or_default(),
            flags: flags.split_off_mut(..contacts).unwrap_or_default(),
            reference: reference.split_off(contacts),
            previous: previous.split_off(contacts),
            history: history.split_off(contacts),
            rest_length: rest_length.split_off(..contacts.min(rest_length.len())).unwrap_or_default(),
            strength: strength.split_off(..contacts.min(strength.len())).unwrap_or_default(),
            net,
            halo: halo.split_off_mut(..slots).unwrap_or_default(),
            virials: virials.split_off(length),
            virial_halo: virial_halo.split_off_mut(..slots.min(virial_halo.len())).unwrap_or_default(),
        });
    }
    (&block.rows, tiles)
}
