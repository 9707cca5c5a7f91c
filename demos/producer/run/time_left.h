#pragma once
/// Estimates the remaining time of a run from the frames that are finished.

namespace offstage::producer {

class TimeLeft {
 public:
  /// `frames`: number of frames to draw. `frames_to_simulate`: number of frames to simulate. `warm_ups`:
  /// number of first frames that take longer, because each drawing thread prepares its shaders and meshes
  /// with its first frame. `drawing_ms`: initial estimate of the time to draw a frame [ms].
  TimeLeft(int frames, int frames_to_simulate, int warm_ups, double drawing_ms)
      : frames_(frames), to_simulate_(frames_to_simulate), warm_ups_(warm_ups), guess_ms_(drawing_ms) {}

  /// Adds a simulated frame, and the time that it took [ms].
  void simulated(double ms);
  /// Adds a finished frame, the time that it took [ms], and the time since the start of the run [s].
  void finished(double drawing_ms, double elapsed_s);

  /// Returns the finished fraction of the work, with the mean times of simulated and finished frames as
  /// weights.
  double fraction() const;
  /// Returns whether frames after the warm-up are finished, so that seconds() does not count its cost for
  /// each frame.
  bool is_steady() const { return done_ > warm_ups_; }
  /// Returns the remaining time [s]; 0 if it is unknown. `elapsed_s`: time since the start of the run.
  double seconds(double elapsed_s) const;

 private:
  double simulation_mean_ms() const;
  double drawing_mean_ms() const;

  int frames_, to_simulate_, warm_ups_;
  double guess_ms_;
  int simulated_ = 0, done_ = 0;
  double simulation_ms_ = 0, drawing_ms_ = 0;
  // At the end of the warm-up.
  int warm_simulated_ = 0;
  double warm_drawing_ms_ = 0, warm_s_ = 0;
};

}  // namespace offstage::producer
