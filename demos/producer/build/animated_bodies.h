#pragma once
/// Bodies whose model file plays an animation: the pieces that collide, and their motion.

#include <vector>

#include "producer/build/decomposition_cache.h"
#include "producer/build/models.h"
#include "producer/scene/scene.h"
#include "render/model_rig.h"
#include "sim/dynamics/keyframes.h"

namespace offstage::producer {

/// The time within a clip at a time of the film [s].
double clip_time(const ModelAnimation& animation, double duration, double time);

/// The pieces of a model that collide, with their shapes at the start of a clip. Scaling of nodes during the
/// clip, and morph targets, do not change these shapes. Bones with fewer than four vertices, or with a flat
/// skin, have no piece.
std::vector<AnimatedPiece> collision_pieces(const render::ModelRig& rig, int clip,
                                            const DecompositionCache& cache);

/// Motion of a piece over a film of the length `end` [s]. `own`: the motion of the body; `rest`: its initial
/// pose; `scale`: scale factor of the model. The animation is sampled 120 times per second. Where it starts
/// again in a pose other than its last one, the piece jumps.
sim::KeyframeTrack piece_track(const render::ModelRig& rig, const AnimatedPiece& piece,
                               const ModelAnimation& animation, const sim::KeyframeTrack& own,
                               const sim::Pose& rest, double scale, double end);

}  // namespace offstage::producer
