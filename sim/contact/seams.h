#pragma once
/// Seams: edges and side faces that are flush with other pieces or bodies, which nothing can run into.
/// Between triangles of one mesh the narrow phase knows them (mesh_surface.h); here are those between bodies
/// side by side, between the convex parts of one body, and between triangles that do not share their
/// vertices.

#include <span>
#include <vector>

#include "sim/contact/contact_pair.h"

namespace offstage::sim {

/// Steps between two surfaces that are lower than this are none, and do not stop anything [m]; of bodies
/// smaller than a decimetre, than this share of their extent.
constexpr Real kFlush = 1e-4, kFlushShare = 1e-3;

/// Removes from pairs found at one time of a sub-step of length h the contacts at seams: those of a convex
/// piece that it would have with something on or below a face on which it already lies, and which does not
/// rise above that face. A contact at the foot of a slope gets the slope's normal instead. Pairs that share a
/// body must be given together. Returns the pairs that have changed, in the order given.
std::vector<ContactPair*> remove_seam_contacts(std::span<ContactPair* const> pairs, Real time, Real h);

}  // namespace offstage::sim
