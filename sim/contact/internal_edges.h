#pragma once
/// Internal edges: edges and side faces that are covered by flush neighbouring pieces or bodies, so that no
/// object can collide with them. The narrow phase handles internal edges between triangles of one mesh
/// (mesh_surface.h). This file handles internal edges between adjacent bodies, between the convex parts of
/// one body, and between triangles that do not share vertices.

#include <span>
#include <vector>

#include "sim/contact/contact_pair.h"

namespace offstage::sim {

/// Two surfaces count as flush if the step between them is at most kFlush high [m], so that it does not stop
/// objects. For bodies smaller than 0.1 m the limit is kFlushFraction times their extent.
constexpr Real kFlush = 1e-4, kFlushFraction = 1e-3;

/// Removes the contacts at internal edges. The contacts of the pairs must have been found at one time of a
/// sub-step of length h [s], and pairs that share a body must be given together. A contact of a convex piece
/// is at an internal edge if the piece already lies on a face and the other piece does not rise above that
/// face. If another piece of the body lies on a face, and the plane of this face separates the two pieces
/// throughout the sub-step, the contact gets the normal of that face. A contact of the same piece with a body
/// that is not dynamic, which does not touch yet, is removed if this plane separates the two pieces. A
/// contact at the foot of a slope gets the normal of the slope. Returns the pairs that have changed, in the
/// order given.
std::vector<ContactPair*> remove_internal_edge_contacts(std::span<ContactPair* const> pairs, Real time,
                                                        Real h);

}  // namespace offstage::sim
