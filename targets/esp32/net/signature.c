/* SPDX-License-Identifier: MIT */
#include "net/signature.h"

#include "mbedtls/ecdsa.h"

enum { HALF = SIGNATURE_SIZE / 2 };

bool signature_is_good(const uint8_t key[SIGNATURE_KEY_SIZE], const uint8_t digest[SHA256_SIZE],
                       const uint8_t signature[SIGNATURE_SIZE]) {
    mbedtls_ecp_group curve;
    mbedtls_ecp_point point;
    mbedtls_mpi first, second;
    mbedtls_ecp_group_init(&curve);
    mbedtls_ecp_point_init(&point);
    mbedtls_mpi_init(&first);
    mbedtls_mpi_init(&second);
    /* Each returns 0 when it went well. */
    bool good = mbedtls_ecp_group_load(&curve, MBEDTLS_ECP_DP_SECP256R1) == 0 &&
                mbedtls_ecp_point_read_binary(&curve, &point, key, SIGNATURE_KEY_SIZE) == 0 &&
                mbedtls_ecp_check_pubkey(&curve, &point) == 0 &&
                mbedtls_mpi_read_binary(&first, signature, HALF) == 0 &&
                mbedtls_mpi_read_binary(&second, signature + HALF, HALF) == 0 &&
                mbedtls_ecdsa_verify(&curve, digest, SHA256_SIZE, &point, &first, &second) == 0;
    mbedtls_mpi_free(&second);
    mbedtls_mpi_free(&first);
    mbedtls_ecp_point_free(&point);
    mbedtls_ecp_group_free(&curve);
    return good;
}
