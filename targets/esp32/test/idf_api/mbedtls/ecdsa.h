/* SPDX-License-Identifier: MIT
 * What the firmware uses of mbedTLS 3 in ESP-IDF v5.5. The structures are its own affair. */
#pragma once

#include <stddef.h>

typedef struct {
    void *inside[2];
} mbedtls_mpi;
typedef struct {
    mbedtls_mpi x, y, z;
} mbedtls_ecp_point;
typedef struct {
    void *inside[32];
} mbedtls_ecp_group;
typedef enum { MBEDTLS_ECP_DP_SECP256R1 = 3 } mbedtls_ecp_group_id;

void mbedtls_mpi_init(mbedtls_mpi *);
void mbedtls_mpi_free(mbedtls_mpi *);
int mbedtls_mpi_read_binary(mbedtls_mpi *, const unsigned char *, size_t);
void mbedtls_ecp_point_init(mbedtls_ecp_point *);
void mbedtls_ecp_point_free(mbedtls_ecp_point *);
int mbedtls_ecp_point_read_binary(const mbedtls_ecp_group *, mbedtls_ecp_point *, const unsigned char *,
                                  size_t);
void mbedtls_ecp_group_init(mbedtls_ecp_group *);
void mbedtls_ecp_group_free(mbedtls_ecp_group *);
int mbedtls_ecp_group_load(mbedtls_ecp_group *, mbedtls_ecp_group_id);
int mbedtls_ecp_check_pubkey(const mbedtls_ecp_group *, const mbedtls_ecp_point *);
int mbedtls_ecdsa_verify(mbedtls_ecp_group *, const unsigned char *, size_t, const mbedtls_ecp_point *,
                         const mbedtls_mpi *, const mbedtls_mpi *);
