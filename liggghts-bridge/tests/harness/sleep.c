/* Open MPI calls sched_yield between two polls while it waits: see `SLEEP` in mod.rs. */
#include <time.h>

int sched_yield(void)
{
  const struct timespec pause = {0, 20000};
  return nanosleep(&pause, 0);
}
