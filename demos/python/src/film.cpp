#include "film.h"

#include "producer/build/picture.h"
#include "producer/build/simulation.h"
#include "producer/run/fingerprint.h"
#include "producer/run/production.h"
#include "producer/run/snapshot_cache.h"

namespace offstage::python {

void pin_environment_once(int threads, render::GlPlatform platform) {
  static std::once_flag done;
  std::call_once(done, [&] {
    render::pin_environment(threads > 0 ? threads : producer::available_processors(), platform);
  });
}

Film::Film(std::shared_ptr<const SharedScene> scene, FilmJob job)
    : scene_(std::move(scene)), job_(std::move(job)), worker_([this] {
        try {
          produce();
        } catch (...) {
          const std::lock_guard lock(mutex_);
          failure_ = std::current_exception();
        }
        const std::lock_guard lock(mutex_);
        ended_ = true;
        changed_.notify_all();
      }) {}

Film::~Film() {
  cancel();
}

void Film::cancel() {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  changed_.notify_all();
}

bool Film::cancelled() const {
  const std::lock_guard lock(mutex_);
  return cancelled_;
}

int Film::done() const {
  const std::lock_guard lock(mutex_);
  return done_;
}

bool Film::push(FilmFrame frame) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return cancelled_ || ready_.size() < kAhead; });
  if (cancelled_) return false;
  ready_.push_back(std::move(frame));
  changed_.notify_all();
  return true;
}

std::optional<FilmFrame> Film::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return cancelled_ || ended_ || !ready_.empty(); });
  if (cancelled_) return {};
  if (ready_.empty()) {
    if (failure_) std::rethrow_exception(failure_);
    return {};
  }
  FilmFrame frame = std::move(ready_.front());
  ready_.pop_front();
  ++done_;
  changed_.notify_all();
  return frame;
}

void Film::produce() {
  const producer::Scene& scene = scene_->loaded.scene;
  const bool draws = job_.images || job_.channels;
  const bool needs_previous = job_.channels || producer::subframes(scene.render.quality) > 1;
  std::optional<producer::SnapshotCache> cache;
  std::optional<producer::Simulation> simulation;
  if (job_.cache)
    cache.emplace(*job_.cache)
        .open(producer::simulation_key(scene_->loaded, scene_->models), scene.frame_count());
  else
    simulation.emplace(scene, scene_->models);
  std::optional<render::Context> context;
  std::optional<producer::Picture> picture;
  if (draws) {
    context.emplace();
    picture.emplace(scene, scene_->models, *context);
  }
  const auto state_at = [&](int frame) {
    if (cache) return std::make_shared<const producer::Snapshot>(cache->read(frame));
    while (simulation->frame() < frame && !cancelled()) simulation->advance();
    return std::make_shared<const producer::Snapshot>(simulation->snapshot());
  };
  std::shared_ptr<const producer::Snapshot> last;
  for (const int number : job_.frames) {
    std::shared_ptr<const producer::Snapshot> previous;
    if (draws && needs_previous && number > 1)
      previous = last && last->frame == number - 1 ? last : state_at(number - 1);
    const std::shared_ptr<const producer::Snapshot> current = state_at(number);
    if (cancelled()) return;
    if (!previous) previous = current;
    last = current;
    FilmFrame frame{number, current->time, {}, {}, current};
    if (job_.images) frame.image = picture->draw(*previous, *current, [this] { return cancelled(); });
    if (job_.channels) frame.channels = picture->channels(*previous, *current);
    if (!push(std::move(frame))) return;
  }
}

}  // namespace offstage::python
