#pragma once
/// Division of a solid into round cells of about the same size, for thin shells. The hull of a piece of a
/// curved shell is thicker than the shell, and the more so the longer the piece is. A single cut shortens a
/// piece in one direction only. Therefore a search by single cuts gains little and stops early.

#include <vector>

#include "sim/geometry/solid_piece.h"

namespace offstage::sim {

/// Returns at most `count` centres of a centroidal Voronoi tessellation of the surface, by Lloyd's iteration
/// [m]. See Du, Faber, Gunzburger, "Centroidal Voronoi tessellations" (1999).
std::vector<Vec3> spread_centres(const SolidPiece& solid, std::size_t count);

/// Area of the polygons [m^2].
Real surface_area(const SolidPiece& solid);

/// Returns, for each centre, the part of the solid that is nearer to it than to any other centre. The result
/// does not depend on the number of threads. Distances below `tolerance` count as zero [m].
std::vector<SolidPiece> voronoi_pieces(const SolidPiece& solid, const std::vector<Vec3>& centres,
                                       Real tolerance);

}  // namespace offstage::sim
