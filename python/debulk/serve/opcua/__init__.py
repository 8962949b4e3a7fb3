"""The service as an OPC UA Machine Vision server (OPC 40100-1)."""
