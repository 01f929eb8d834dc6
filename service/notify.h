/* Tells systemd how the daemon is (sd_notify(3)); does nothing where it was not started by it. */
#ifndef PELT_SERVICE_NOTIFY_H
#define PELT_SERVICE_NOTIFY_H

/* Sends `state` ("READY=1", "STOPPING=1") to $NOTIFY_SOCKET. 0: sent, or there is none; -1: errno.
 */
int notify_send(const char *state);

#endif
