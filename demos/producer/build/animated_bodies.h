#pragma once
/// The pieces of an animated model file that collide, and their motion.

#include <vector>

#include "producer/build/decomposition_cache.h"
#include "producer/build/models.h"
#include "producer/scene/scene.h"
#include "render/model_rig.h"
#include "sim/dynamics/keyframes.h"

namespace offstage::producer {

/// Returns the time within the clip [s]. `duration`: length of the clip [s]; `time`: time of the film [s].
double clip_time(const ModelAnimation& animation, double duration, double time);

/// Returns the pieces of a model that collide, with their shapes at the start of a clip. Scaling of nodes
/// during the clip, and morph targets, do not change these shapes. Bones with fewer than four vertices, or
/// with a flat skin, have no piece.
std::vector<AnimatedPiece> collision_pieces(const render::ModelRig& rig, int clip,
                                            const DecompositionCache& cache);

/// Returns the motion of a piece in a film that ends at `end` [s]. `own`: motion of the body; `rest`: initial
/// pose of the body; `scale`: scale factor of the model. The animation is sampled 120 times per second. If
/// the first pose of a looping animation differs from the last one, the piece jumps.
sim::KeyframeTrack piece_track(const render::ModelRig& rig, const AnimatedPiece& piece,
                               const ModelAnimation& animation, const sim::KeyframeTrack& own,
                               const sim::Pose& rest, double scale, double end);

}  // namespace offstage::producer
