/* Linked into sanitized builds only: no shared library is ever unloaded.
 *
 * LeakSanitizer looks for leaks when the process ends and names them by the modules that are mapped
 * then. Mesa's drivers leave some hundred bytes behind at every unloading; once unmapped they are
 * "<unknown module>", which no suppression can match, and pointers that only their data held count
 * as lost. */
#include <dlfcn.h>

__attribute__((visibility("default"))) int dlclose(void *handle) {
    (void)handle;
    return 0;
}
