// The command line program; see producer/cli/command_line.h.

#include <malloc.h>

#include "engine/watch_command.h"
#include "producer/cli/command_line.h"
#include "tune/tune_command.h"

int main(int argc, char** argv) {
  // Each frame allocates pictures of the same sizes. Returning this memory to the system in between would
  // take a twentieth of the time of a draft, because each page is cleared again.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
  return offstage::producer::run(argc, argv, offstage::tune::tune_command, offstage::engine::watch_command);
}
