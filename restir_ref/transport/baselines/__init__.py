"""What ReSTIR PT is compared with: path reuse, ReSTIR GI, ReSTIR DI."""
