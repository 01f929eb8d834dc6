/* /v1/jobs and what lies under it: posting long work, looking at it, fetching results, deleting. */
#ifndef PELT_SERVICE_JOBS_HTTP_H
#define PELT_SERVICE_JOBS_HTTP_H

#include "service/request.h"

/* The `answer` of routes: see routes.h. */
enum MHD_Result jobs_http_answer(struct request *request);        /* POST a scene; GET the list */
enum MHD_Result jobs_http_answer_one(struct request *request);    /* GET, DELETE */
enum MHD_Result jobs_http_answer_result(struct request *request); /* the main one, or by its name */

#endif
